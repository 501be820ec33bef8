(* Which value of JSON tells which answer, as docs/certificates.md has it.  A number may stand in an
   answer as any fraction of its value; what an answer has to hold besides, check_answer looks at.
   To be read with Json.v and Spec.v: `accepted_bytes` speaks of both. *)
From Coq Require Import Ascii String ZArith QArith List Bool Arith NArith.
From ParcJax Require Import Spec Arithmetic Checker Polytopes Doubt NoPlan Answer Episode Json.
Import ListNotations.
Local Open Scope string_scope.

(* ---- Lists, pairs, and objects, whose fields are told by their names ---- *)
Definition list_is {A} (is : json -> A -> Prop) (v : json) (l : list A) : Prop :=
  exists vs, v = Arr vs /\ Forall2 is vs l.
Definition pair_is {A B} (is : json -> A -> Prop) (is' : json -> B -> Prop) (v : json) (p : A * B)
  : Prop :=
  exists a b, v = Arr [a; b] /\ is a (fst p) /\ is' b (snd p).
Definition fields := list (string * json).
(* These fields and maybe some of the optional ones, no others. *)
Definition object_is (names optional : list string) (v : json) (o : fields) : Prop :=
  v = Obj o /\ (forall name, In name names -> exists v, In (name, v) o) /\
  (forall name v, In (name, v) o -> In name names \/ In name optional).
Definition field_is {A} (name : string) (is : json -> A -> Prop) (o : fields) (x : A) : Prop :=
  exists v, In (name, v) o /\ is v x.

(* ---- Numbers ---- *)
Definition value_of (c : ascii) : nat :=
  if within "0" "9" c then nat_of_ascii c - nat_of_ascii "0"
  else S (S (S (S (S (S (S (S (S (S (nat_of_ascii c - nat_of_ascii "a")))))))))).
Definition hex_digit (c : ascii) : bool := within "0" "9" c || within "a" "f" c.
(* What digits spell after those that spell n. *)
Fixpoint spelled (base n : Z) (s : string) : Z :=
  match s with "" => n | String c s' => spelled base (n * base + Z.of_nat (value_of c)) s' end.
Definition some (test : ascii -> bool) (s : string) : Prop := s <> "" /\ every test s = true.
(* Digits, maybe with a point: as a whole number, and how many are behind the point. *)
Definition pointed (test : ascii -> bool) (base : Z) (s : string) (z : Z) (places : nat) : Prop :=
  exists a b, some test a /\ every test b = true /\ (s = a /\ b = "" \/ s = a ++ "." ++ b) /\
    z = spelled base 0 (a ++ b) /\ places = String.length b.
Definition exponent_is (s : string) (e : Z) : Prop :=
  exists d, some digit d /\
    ((s = d \/ s = "+" ++ d) /\ e = spelled 10 0 d \/ s = "-" ++ d /\ e = (- spelled 10 0 d)%Z).
Definition scaled (z base e : Z) : Q := (inject_Z z * Qpower (inject_Z base) e)%Q.
Inductive unsigned_is : string -> Q -> Prop :=
  | decimal s z n : pointed digit 10 s z n -> unsigned_is s (scaled z 10 (- Z.of_nat n))
  | scientific s z n t e : pointed digit 10 s z n -> exponent_is t e ->
      unsigned_is (s ++ "e" ++ t) (scaled z 10 (e - Z.of_nat n))
  | ratio a b : some digit a -> some digit b -> spelled 10 0 b <> 0%Z ->
      unsigned_is (a ++ "/" ++ b) (inject_Z (spelled 10 0 a) / inject_Z (spelled 10 0 b))
  | hexadecimal s z n t e : pointed hex_digit 16 s z n -> exponent_is t e ->
      unsigned_is ("0x" ++ s ++ "p" ++ t) (scaled z 2 (e - 4 * Z.of_nat n)).
Definition number_is (v : json) (q : Q) : Prop :=
  exists s x, unsigned_is s x /\ (v = Str s /\ q == x \/ v = Str ("-" ++ s) /\ q == - x)%Q.
Definition vec_is : json -> vec -> Prop := list_is number_is.
Definition index_is (v : json) (i : nat) : Prop :=
  exists s, v = Int s /\ every digit s = true /\ Z.of_nat i = spelled 10 0 s.

(* ---- Problem, network, tube ---- *)
Definition rows_are (o : fields) (A : poly) : Prop :=
  exists a b, field_is "A" (list_is vec_is) o a /\ field_is "b" vec_is o b /\
    length a = length b /\ A = combine a b.
Definition poly_is (v : json) (A : poly) : Prop :=
  exists o, object_is ["A"; "b"] [] v o /\ rows_are o A.
Definition box_is (v : json) (B : list (Q * Q)) : Prop :=
  exists o lo hi, object_is ["lo"; "hi"] [] v o /\ field_is "lo" vec_is o lo /\
    field_is "hi" vec_is o hi /\ length lo = length hi /\ B = combine lo hi.
Definition obstacle_is (steps : nat) (v : json) (o : obstacle) : Prop :=
  exists f, object_is ["A"; "b"] ["steps"] v f /\ rows_are f (rows o) /\
    (field_is "steps" (pair_is index_is index_is) f (first o, last o) \/
     (forall v, ~ In ("steps", v) f) /\ first o = O /\ last o = pred steps).
Definition part_is (v : json) (p : part) : Prop :=
  exists o, object_is ["points"] ["radius"; "vertices"] v o /\
    field_is "points" (list_is index_is) o (corners p) /\
    match grown_by p with
    | Disc r => field_is "radius" number_is o r /\ forall v, ~ In ("vertices", v) o
    | Hull vs => field_is "vertices" (list_is vec_is) o vs /\ forall v, ~ In ("radius", v) o
    end.
Definition problem_is (v : json) (P : problem) : Prop :=
  exists o, object_is ["n_p"; "points"; "n_q"; "n_k"; "steps"; "dt"; "domain"; "goal"; "start";
                       "obstacles"; "body"] [] v o /\
    field_is "n_p" index_is o (n_p P) /\ field_is "n_q" index_is o (n_q P) /\
    field_is "n_k" index_is o (n_k P) /\ field_is "points" index_is o (n_points P) /\
    field_is "steps" index_is o (steps P) /\ field_is "domain" box_is o (domain P) /\
    field_is "goal" poly_is o (goal P) /\
    field_is "start" (fun v A => v = Null /\ A = [] \/ poly_is v A) o (start P) /\
    field_is "obstacles" (list_is (obstacle_is (steps P))) o (obstacles P) /\
    field_is "body" (fun v l => exists o, object_is ["parts"] [] v o /\
      field_is "parts" (list_is part_is) o l) o (parts P).
Definition network_is (v : json) (N : list layer) : Prop :=
  exists o w b, object_is ["weights"; "biases"] [] v o /\
    field_is "weights" (list_is (list_is vec_is)) o w /\ field_is "biases" (list_is vec_is) o b /\
    length w = length b /\ Forall2 (fun wb L => length (fst wb) = length (snd wb) /\
      L = combine (fst wb) (snd wb)) (combine w b) N.
Definition multipliers_are : json -> multipliers -> Prop := list_is (pair_is index_is number_is).
Definition error_is (v : json) (E : error) : Prop :=
  match E with Widths e => vec_is v e | Rows A => poly_is v A end.
Definition final_is (v : json) (E : error * goal_hints) : Prop :=
  match E with
  | (Widths e, H) => vec_is v e /\ H = []
  | (Rows A, H) => exists o, object_is ["A"; "b"; "goal"] [] v o /\ rows_are o A /\
      field_is "goal" (list_is (list_is multipliers_are)) o H
  end.
Definition tube_is (v : json) (EH : tube * list goal_hints) : Prop :=
  exists o ends, object_is ["edges"; "interval"; "final"] [] v o /\
    field_is "edges" (list_is vec_is) o (edges (fst EH)) /\
    field_is "interval" (list_is (list_is (list_is error_is))) o (intervals (fst EH)) /\
    field_is "final" (list_is final_is) o ends /\
    finals (fst EH) = map fst ends /\ snd EH = map snd ends.

(* ---- Entries ---- *)
Definition sep_is : json -> sepn -> Prop :=
  list_is (list_is (list_is (pair_is index_is multipliers_are))).
Definition sample_is (v : json) (s : sample) : Prop :=
  exists o, object_is ["p0"; "k"; "sep"] [] v o /\ field_is "p0" vec_is o (sample_p0 s) /\
    field_is "k" vec_is o (sample_k s) /\ field_is "sep" sep_is o (sample_sep s).
(* A digit for each hidden neuron, layer by layer. *)
Definition pattern_is (v : json) (bits : list (list bool)) : Prop :=
  exists s, v = Str s /\
    list_ascii_of_string s = map (fun b : bool => if b then "1" else "0")%char (concat bits).
Definition piece_is (v : json) (s : piece) : Prop :=
  exists o p0 k, object_is ["p0"; "k"; "bin"; "pattern"; "sep"] [] v o /\
    field_is "p0" vec_is o p0 /\ field_is "k" vec_is o k /\ inner s = (p0 ++ k)%list /\
    field_is "bin" index_is o (which s) /\ field_is "pattern" pattern_is o (pattern s) /\
    field_is "sep" sep_is o (piece_sep s).
Definition boxed_is (v : json) (s : boxed) : Prop :=
  exists o k room r, object_is ["p0"; "k"; "room"; "sep"] [] v o /\
    field_is "p0" vec_is o (middle_p0 s) /\ field_is "k" vec_is o k /\
    field_is "room" (object_is ["p0"; "k"] []) o room /\
    field_is "p0" vec_is room (room_p0 s) /\ field_is "k" vec_is room r /\
    length k = length r /\ Forall2 (fun kr I => fst I == fst kr - snd kr /\
      snd I == fst kr + snd kr)%Q (combine k r) (region s) /\
    field_is "sep" sep_is o (boxed_sep s).

(* ---- No plan, and volumes ---- *)
Definition contact_is (v : json) (c : contact) : Prop :=
  pair_is vec_is (list_is vec_is) v (body c, errors c).
Definition group_is (v : json) (g : group) : Prop :=
  pair_is vec_is (list_is contact_is) v (blend g, contacts g).
Definition hit_is (v : json) (h : hit) : Prop :=
  exists a b c d e, v = Arr [a; b; c; d; e] /\ index_is a (whom h) /\ index_is b (which_part h) /\
    index_is c (step h) /\ number_is d (share h) /\ list_is group_is e (groups h).
Definition use_is (v : json) (u : use) : Prop :=
  exists i m, index_is i (which_row u) /\ number_is m (times u) /\
    match shrink u with
    | None => v = Arr [i; m]
    | Some x => exists e, v = Arr [i; m; e] /\ vec_is e x
    end.
Fixpoint reason_is (v : json) (r : reason) : Prop :=
  match r with
  | Misses us => exists w, v = Obj [("goal", w)] /\ list_is use_is w us
  | Elsewhere m => exists w, v = Obj [("start", w)] /\ multipliers_are w m
  | Hits h => exists w, v = Obj [("hit", w)] /\ hit_is w h
  | Safe s => exists w, v = Obj [("safe", w)] /\ sep_is w s
  | Open => exists w, v = Obj [("open", w)]
  | Bounded r' => exists w, v = Obj [("bounded", w)] /\ reason_is w r'
  end.
(* A tree as its nodes, the lower part before the upper one. *)
Inductive nodes_are : list json -> tree -> Prop :=
  | leaf v r : reason_is v r -> nodes_are [v] (Leaf r)
  | split v i x ls us lower upper : pair_is index_is number_is v (i, x) -> nodes_are ls lower ->
      nodes_are us upper ->
      nodes_are (Obj [("split", v)] :: ls ++ us)%list (Split i x lower upper).
Definition proof_is (kind : string) (v : json) (p : proof) : Prop :=
  exists o, object_is ["kind"; "z"; "faces"; "tree"] [] v o /\ In ("kind", Str kind) o /\
    field_is "z" box_is o (z_box p) /\
    field_is "faces" (list_is (pair_is (list_is use_is) (list_is use_is))) o (faces p) /\
    field_is "tree" (fun v t => exists vs, v = Arr vs /\ nodes_are vs t) o (root p).
Definition absence_is (v : json) (x : absence) : Prop :=
  match x with
  | Unclaimed => v = Null
  | Unread => True                                      (* refused *)
  | Proved p => proof_is "proved" v p
  | Bracket p => proof_is "bracket" v p
  end.

(* ---- A whole answer.  An entry that is None is refused ---- *)
Definition entry_is {A} (is : json -> A -> Prop) (v : json) (x : option A) : Prop :=
  match x with Some s => is v s | None => True end.
Definition entries_are {A} (name : string) (is : json -> A -> Prop) (o : fields)
    (l : list (option A)) : Prop :=
  field_is name (list_is (entry_is is)) o l \/ (forall v, ~ In (name, v) o) /\ l = [].
Definition answer_is (v : json) (a : answer) : Prop :=
  exists o, object_is ["format"; "problem"; "network"; "tube"; "claim"; "hash"; "samples"; "sets";
                       "no_plan"] ["corridors"; "doubt"; "meta"] v o /\
    In ("format", Str "parc_jax.answer/3") o /\
    field_is "problem" problem_is o (scene a) /\ field_is "network" network_is o (net a) /\
    field_is "tube" tube_is o (Answer.around a, hints a) /\
    entries_are "samples" sample_is o (samples a) /\ entries_are "sets" piece_is o (sets a) /\
    entries_are "corridors" sample_is o (corridors a) /\
    entries_are "doubt" boxed_is o (doubts a) /\ field_is "no_plan" absence_is o (absent a).

(* ---- A whole episode.  The place of a pose, then its heading where the robot turns ---- *)
Definition manoeuvre_is (dt : Q) (turns : bool) (H : list goal_hints) (v : json) (m : manoeuvre)
  : Prop :=
  exists o, object_is ["begin"; "pose"; "problem"; "sample"] [] v o /\
    field_is "begin" number_is o (begin m) /\
    field_is "pose" vec_is o (pose m ++ (if turns then [heading m] else []))%list /\
    (turns = false -> heading m = 0%Q) /\
    field_is "problem" (fun w P => problem_is w P /\
      exists o, w = Obj o /\ field_is "dt" number_is o dt) o (asked m) /\
    its_hints m = H /\ field_is "sample" (entry_is sample_is) o (its_plan m).
Definition episode_is (v : json) (e : episode) : Prop :=
  exists o H more, object_is ["format"; "hash"; "network"; "tube"; "manoeuvres"; "claim"; "copies";
                              "doubt"; "premises"] ["meta"] v o /\
    In ("format", Str "parc_jax.episode/3") o /\
    field_is "network" network_is o (its_net e) /\ field_is "tube" tube_is o (its_tube e, H) /\
    field_is "doubt" vec_is o (doubt e ++ more)%list /\ length more = 2%nat /\
    field_is "manoeuvres" (list_is (manoeuvre_is (tick e) (turning e) H)) o (done e).
