(* The checker of a whole answer.  Nothing here has to be believed, but for what an answer holds and
   what tells entries apart: `accepted` in Statements.v says what is true of an answer that is
   accepted. *)
From Coq Require Import ZArith QArith List Bool Arith.
From ParcJax Require Import Spec Arithmetic Checker Doubt NoPlan.
Import ListNotations.
Open Scope Q_scope.

(* ---- What a file holds: the question, and what it claims.  None: an entry that could not be read
   ---- *)
Inductive absence := Unclaimed | Unread | Proved (p : proof) | Bracket (p : proof).
Record answer := Answer {
  scene : problem; net : list layer; around : tube; hints : list goal_hints;
  samples : list (option sample); sets : list (option piece); corridors : list (option sample);
  doubts : list (option boxed); absent : absence }.

(* ---- What is said twice counts once: entries that prove as much have equal keys ---- *)
Definition key := list (nat * Q).
Definition key_of_sep (s : sepn) : key :=
  flat_map (fun runs => (length runs, 0) :: flat_map (fun r => (fst r, 0) :: (length (snd r), 0) ::
    snd r) runs)
           (concat s).
Definition numbers (v : vec) : key := map (pair O) v.
Definition key_of_sample (s : sample) : key := numbers (sample_p0 s ++ sample_k s).
Definition key_of_set (s : piece) : key :=
  (which s, 0) :: map (fun b : bool => (if b then 1%nat else O, 0)) (concat (pattern s))
    ++ key_of_sep (piece_sep s).
Definition key_of_corridor (s : sample) : key := key_of_sep (sample_sep s).
Definition key_of_box (s : boxed) : key :=
  numbers (middle_p0 s ++ room_p0 s ++ flat_map (fun I => [fst I; snd I]) (region s)).

(* Keys are sorted as in a dictionary, then counted while they increase.  The sort is not trusted:
   what does not increase is not counted.  (No recursion here is as deep as a list is long:
   JavaScript's stack would end.) *)
Fixpoint ahead (a b : key) : bool :=
  match a, b with
  | (i, x) :: a', (j, y) :: b' =>
      (i <? j)%nat || Nat.eqb i j && (if same_number x y then ahead a' b' else qlt x y ||
        Qeq_bool x y && ahead a' b')
  | _, _ => false
  end.
Fixpoint merge (most a b done : list key) : list key :=         (* onto done, the last first *)
  match most with
  | [] => done
  | _ :: most' =>
      match a, b with
      | [], [] => done
      | x :: a', [] => merge most' a' [] (x :: done)
      | [], y :: b' => merge most' [] b' (y :: done)
      | x :: a', y :: b' => if ahead x y then merge most' a' b (x :: done) else merge most' a
        b' (y :: done)
      end
  end.
Fixpoint deal (l a b : list key) : list key * list key :=
  match l with [] => (a, b) | x :: l' => deal l' b (x :: a) end.
Fixpoint sort (depth : nat) (l : list key) : list key :=
  match depth, l with
  | S depth', _ :: _ :: _ =>
      let (a, b) := deal l [] [] in
      let a := sort depth' a in let b := sort depth' b in rev_append (merge l a b []) []
  | _, _ => l
  end.
Fixpoint climb (from : key) (l : list key) (n : nat) : nat :=
  match l with [] => n | x :: l' => if ahead from x then climb x l' (S n) else climb from l' n end.
Definition distinct (l : list key) : nat := match sort 30 l with [] => O | x :: l' =>
  climb x l' 1 end.
Definition keys {A} (key_of : A -> key) (l : list (option A)) : list key :=
  fold_left (fun found x => match x with Some s => key_of s :: found | None => found end) l [].

(* ---- How much of all, in parts of 100,000 and rounded down.  The quotient is tried; 0 says
   nothing ---- *)
Definition share_of (part all : Q) : Z :=
  let q := qdiv (part * 100000) all in
  let n := (Qnum q / Zpos (Qden q))%Z in
  if qle (inject_Z n * all) (part * 100000) then n else 0%Z.

(* ---- The verdict ---- *)
Inductive finding := Nothing | No_plan | Shares (safe_ unsafe_ : Z).
Record report := Report {
  n_samples : nat; n_sets : nat; n_corridors : nat; n_doubts : nat; found : finding;
  (* bins, and those whose tube leaves out the model itself *)
  n_bins : nat; n_without : nat }.
(* Marks: of samples, sets, corridors, boxes of doubt and proofs that there is no plan, whether each
   is proved. *)
Inductive verdict := Misfit | Refused (marks : list (list bool)) | Accepted (marks :
  list (list bool)) (r : report).

(* where the program says how far it is: Extract.v *)
Definition told (ok : bool) : bool := ok.
Definition marked {A} (check : A -> bool) (l : list (option A)) : list bool :=
  rev_append (fold_left (fun oks x => told (match x with Some s => check s | None => false end) ::
    oks) l []) [].
Definition check_absence (P : problem) (N : list layer) (E : tube) (H : list goal_hints) (x :
  absence) : list bool :=
  match x with
  | Unclaimed => []
  | Unread => [told false]
  | Proved p => [told (check_no_plan P N E H p)]
  | Bracket p => [told (check_proof P N E H p)]
  end.
Definition finding_of (P : problem) (x : absence) : finding :=
  match x with
  | Bracket p => let '(safe_, unsafe_, all) := volumes P p in Shares (share_of safe_ all) (share_of
    unsafe_ all)
  | Proved _ => No_plan
  | _ => Nothing
  end.
Definition check_answer (a : answer) : verdict :=
  let P := scene a in let N := net a in let E := around a in let H := hints a in
  if context_ok P N E then
    let in_samples := marked (check_sample P N E H) (samples a) in
    let in_sets := marked (check_set P N E H) (sets a) in
    let in_corridors := marked (check_sample P N E H) (corridors a) in
    let in_doubts := marked (check_box P N E H) (doubts a) in
    let marks := [in_samples; in_sets; in_corridors; in_doubts; check_absence P N E H (absent a)] in
    if forallb (forallb (fun ok => ok)) marks then
      Accepted marks (Report
        (distinct (keys key_of_sample (samples a))) (distinct (keys key_of_set (sets a)))
        (distinct (keys key_of_corridor (corridors a))) (distinct (keys key_of_box (doubts a)))
        (finding_of P (absent a))
        (length (bins E)) (length (filter (fun B => negb (centred B)) (bins E))))
    else Refused marks
  else Misfit.
