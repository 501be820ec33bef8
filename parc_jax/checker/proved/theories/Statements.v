(* What is proved, in full: this file compiles only while every theorem says what stands here.  Read
   with Spec.v, which has the words.  The last theorem, `accepted`, is about a whole answer (the
   record of Answer.v); the others are about its entries.  What those take for granted of a problem,
   a network and a tube is context_ok (Checker.v).  Which plans belong to a polytope or a leaf is
   said by set_rows (Polytopes.v) and leaves (NoPlan.v), how far errors reach by reach, which
   directions a corridor has by dirs_of: whatever
   belongs is safe, but how much belongs, these say. *)
From Coq Require Import Reals QArith Qreals List Permutation Sorted.
From ParcJax Require Import Spec Arithmetic Checker Polytopes Doubt NoPlan Answer Episode
  ArithmeticFacts ConditionFacts.
From ParcJax Require Theorems DoubtFacts NoPlanFacts Sanity NotVoid AnswerFacts EpisodeFacts
  HeadingFacts.
Import ListNotations.
Open Scope R_scope.

(* Bins are row-major: the last axis is the fastest. *)
Example order_of_bins : forall i f,
  map box (bins (Tube [[0; 1; 2]; [5; 6; 7]]%Q [i; i; i; i] [f; f; f; f])) =
  [[(0, 1); (5, 6)]; [(0, 1); (6, 7)]; [(1, 2); (5, 6)]; [(1, 2); (6, 7)]]%Q.
Proof. reflexivity. Qed.

(* To succeed, in words of its own: the end is in the goal, and no point of the body is in an
   obstacle that is there. *)
Definition succeeds_is : forall P tau, succeeds P tau <->
  inPoly (goal P) (final_state P tau) /\
  forall o t s b x, In o (obstacles P) -> (first o <= t <= last o)%nat -> 0 <= s <= 1 ->
    In b (parts P) -> inPart (n_p P) b (at_ tau (INR t + s)) x -> ~ inPoly (rows o) x
  := ConditionFacts.succeeds_is.

(* ---- What is accepted is safe ---- *)
Definition sample_is_safe P N E (s : sample) : Prop :=
  inBox (domain P) (toR (sample_k s)) /\ safe P N E (toR (sample_p0 s)) (toR (sample_k s)).
Definition sample_safe : forall P N E H s, context_ok P N E = true ->
  check_sample P N E H s = true ->
  sample_is_safe P N E s
  := Theorems.sample_safe.

(* All plans that keep to the directions of a corridor, in every closed bin that contains their k;
   its own is one. *)
Definition in_corridor P N E H sep (u x : rv) : Prop :=
  inBox (domain P) x /\
  forall B h, In (B, h) (hinted E H) -> inBox (box B) x ->
    inPoly (start P) u /\
    (forall i a b, nth_error (goal P) i = Some (a, b) ->
       exists r, reach (final B) (nth i h []) a = Some r /\
                 dotR a (endR P u (netR N x)) + Q2R r <= Q2R b) /\
    (forall o b d, In ((o, b), d) (combine (tasks P) (dirs_of P sep)) ->
      forall t, (first o <= t <= last o)%nat ->
       exists w c, dir_at d t = Some (w, c) /\ forall i, In i (corners b) ->
         exists r, reach (nth i (nth t (interval B) []) (Rows [])) [] (vscale (-1) w) = Some r /\
           Q2R c + Q2R r < dotR w (knotR P u (netR N x) t i) /\
           Q2R c + Q2R r < dotR w (knotR P u (netR N x) (S t) i)).
Definition corridor_is_safe P N E H (s : sample) : Prop :=
  in_corridor P N E H (sample_sep s) (toR (sample_p0 s)) (toR (sample_k s)) /\
  forall u x, in_corridor P N E H (sample_sep s) u x -> inBox (domain P) x /\ safe P N E u x.
Definition corridor_safe : forall P N E H s, context_ok P N E = true ->
  check_sample P N E H s = true ->
  corridor_is_safe P N E H s
  := Theorems.corridor_safe.

Definition set_is_safe P N E (s : piece) : Prop :=
  exists B h, nth_error (bins E) (which s) = Some B /\
  let member x := forall strict a c, In (strict, (a, c)) (set_rows P N E B h s) ->
    if strict : bool then 0 < dotR a x + Q2R c else 0 <= dotR a x + Q2R c in
  (forall x, member x -> let k := fun i => x (n_p P + i)%nat in
     inBox (domain P) k /\ inBox (box B) k /\
     (forall B', In B' (bins E) -> inBox (box B') k -> B' = B) /\
     safe P N E x k) /\
  exists eps, 0 < eps /\ forall x, (forall i, Rabs (x i - toR (inner s) i) <= eps) -> member x.
Theorem set_safe : forall P N E H s, context_ok P N E = true -> check_set P N E H s = true ->
  set_is_safe P N E s.
Proof.
  intros P N E H s HC HK. destruct (Theorems.set_safe P N E H s HC HK) as (B & h & HB & HS &
    eps & He & HI).
  exists B, h. split; [exact HB|]. split.
  - intros x Hx. apply HS. intros [st [a c]] Hr. exact (Hx st a c Hr).
  - exists eps. split; [exact He|]. intros x Hx st a c Hr. exact (HI x Hx (st, (a, c)) Hr).
Qed.

Definition box_is_safe P N E (s : boxed) : Prop :=
  forall u x,
    (forall i, (i < n_p P)%nat -> Rabs (u i - toR (middle_p0 s) i) <= toR (room_p0 s) i) ->
    inBox (region s) x ->
    inBox (domain P) x /\ safe P N E u x.
Definition box_safe : forall P N E H s, context_ok P N E = true -> check_box P N E H s = true ->
  box_is_safe P N E s
  := DoubtFacts.box_safe.

(* ---- No plan, and volumes ---- *)
Definition all_fail P N E : Prop := forall u x, inBox (domain P) x -> fails P N E u x.
Definition no_plan : forall P N E H p, context_ok P N E = true -> check_no_plan P N E H p = true ->
  all_fail P N E
  := NoPlanFacts.no_plan.

(* The boxes of (z, k) of a proof that are safe, or unsafe. *)
Definition boxes_of P (pick : reason -> bool) (p : proof) : list (list (Q * Q)) :=
  map fst (filter (fun l => pick (snd l)) (leaves (z_box p ++ domain P) (root p))).
Definition volumes_are_true P N E (p : proof) : Prop :=
  tiles (map fst (leaves (z_box p ++ domain P) (root p))) (z_box p ++ domain P) /\
  (forall B u x, In B (boxes_of P is_safe p) -> inside B (place P N u x) -> safe P N E u x) /\
  (forall B u x, In B (boxes_of P is_unsafe p) -> inBox B (place P N u x) -> fails P N E u x) /\
  (forall u x, inBox (domain P) x -> ~ inBox (z_box p ++ domain P) (place P N u x) ->
    fails P N E u x) /\
  let '(safe_, unsafe_, all_) := volumes P p in
  Q2R safe_ = total (boxes_of P is_safe p) /\ Q2R unsafe_ = total (boxes_of P is_unsafe p) /\
  Q2R all_ = volume (z_box p ++ domain P).
Definition volumes_true : forall P N E H p, context_ok P N E = true ->
  check_proof P N E H p = true ->
  volumes_are_true P N E p
  := NoPlanFacts.volumes_true.

(* ---- The words are not empty ---- *)
Definition failing_is_not_safe : forall P N E u x, fails P N E u x -> ~ safe P N E u x
  := NoPlanFacts.failing_is_not_safe.

(* The model's own trajectory: straight between its knots. *)
Definition model (P : problem) (N : list layer) (u x : rv) : trajectory :=
  let y := netR N x in
  Traj (fun s i a => let t := Z.to_nat (Int_part s) in
          (1 - (s - INR t)) * knotR P u y t i a + (s - INR t) * knotR P u y (S t) i a)
       (fun j => offsetR P y (steps P * (n_points P * n_p P) + (n_points P * n_p P + j))%nat).
Definition zero_allowed (P : problem) (B : bin) : Prop :=
  (forall t i, inError (n_p P) (nth i (nth t (interval B) []) (Rows [])) (fun _ => 0)) /\
  inError (n_points P * n_p P + n_q P) (final B) (fun _ => 0).

Definition tube_not_empty : forall P N B u x, (0 < n_p P)%nat -> zero_allowed P B ->
  in_tube P N B u x (model P N u x)
  := Sanity.tube_not_empty.

Definition a_hit_is_not_safe : forall P N E B u x o t b i r, (0 < n_p P)%nat ->
  In B (bins E) -> inBox (box B) x -> zero_allowed P B ->
  In o (obstacles P) -> (first o <= t <= last o)%nat ->
  inPoly (rows o) (knotR P u (netR N x) t i) ->
  In b (parts P) -> In i (corners b) -> grown_by b = Disc r -> ~ safe P N E u x
  := Sanity.a_hit_is_not_safe.

Definition not_void : forall P N E B u x, context_ok P N E = true -> In B (bins E) ->
  centred B = true ->
  in_tube P N B u x (model P N u x)
  := NotVoid.not_void.

Definition model_held : forall P N E B, context_ok P N E = true -> In B (bins E) ->
  (centred B = true <-> forall u x, in_tube P N B u x (model P N u x))
  := NotVoid.model_held.

Definition model_succeeds P N E (s : sample) : Prop :=
  let u := toR (sample_p0 s) in let x := toR (sample_k s) in
  exists B, In B (bins E) /\ inBox (box B) x /\ in_tube P N B u x (model P N u x) /\
    succeeds P (model P N u x).
Definition sample_of_something : forall P N E H s, context_ok P N E = true ->
  forallb centred (bins E) = true ->
  check_sample P N E H s = true -> model_succeeds P N E s
  := NotVoid.sample_of_something.

Definition body_is_somewhere P : Prop :=
  parts P <> [] /\ forall b, In b (parts P) -> forall c : nat -> rv, exists x, inPart (n_p P) b c x.
Definition body_not_void : forall P N E, context_ok P N E = true -> body_is_somewhere P
  := NotVoid.body_not_void.

(* ---- One theorem of a whole answer ---- *)

(* Every entry of a list was read, and this holds of it. *)
Definition each {A} (l : list (option A)) (holds : A -> Prop) : Prop :=
  forall x, In x l -> exists s, x = Some s /\ holds s.
(* So many parts of 100,000 of the whole are of this volume or less; 0 says nothing. *)
Definition share_within (n : Z) (part whole : R) : Prop :=
  n <> 0%Z -> IZR n * whole <= part * 100000.

Definition meaning (a : answer) (r : report) : Prop :=
  let P := scene a in let N := net a in let E := around a in let H := hints a in
  (* what it claims is true *)
  each (samples a) (sample_is_safe P N E) /\ each (sets a) (set_is_safe P N E) /\
  each (corridors a) (corridor_is_safe P N E H) /\ each (doubts a) (box_is_safe P N E) /\
  match absent a, found r with
  | Unclaimed, Nothing => True
  | Proved p, No_plan => all_fail P N E
  | Bracket p, Shares safe_ unsafe_ =>
      volumes_are_true P N E p /\
      share_within safe_ (total (boxes_of P is_safe p)) (volume (z_box p ++ domain P)) /\
      share_within unsafe_ (total (boxes_of P is_unsafe p)) (volume (z_box p ++ domain P))
  | _, _ => False
  end /\
  (* the numbers that are told of it are true *)
  n_samples r = length (samples a) /\ n_sets r = length (sets a) /\
  n_corridors r = length (corridors a) /\ n_doubts r = length (doubts a) /\
  n_bins r = length (bins E) /\
  n_without r = length (filter (fun B => negb (centred B)) (bins E)) /\
  (forall B, In B (bins E) ->
    (centred B = true <-> forall u x, in_tube P N B u x (model P N u x))) /\
  (* and it is about something *)
  (n_without r = O -> each (samples a) (model_succeeds P N E)) /\ body_is_somewhere P.

Theorem accepted : forall a marks r, check_answer a = Accepted marks r -> meaning a r.
Proof.
  intros a marks r HA. destruct (AnswerFacts.accepted_parts a marks r HA) as (HC & S & C & D &
    B & F & ->).
  assert (K : forall (A : Type) (l : list (option A)) (p q : A -> Prop),
    (forall s, p s -> q s) -> AnswerFacts.each l p -> each l q).
  { intros A l p q I L x Hx. destruct (L x Hx) as (s & X & Hs). eauto. }
  unfold meaning. cbn [n_samples n_sets n_corridors n_doubts n_bins n_without found].
  split; [eapply K; [|exact S]; intros s; apply sample_safe, HC|].
  split; [eapply K; [|exact C]; intros s; apply set_safe, HC|].
  split; [eapply K; [|exact D]; intros s; apply corridor_safe, HC|].
  split; [eapply K; [|exact B]; intros s; apply box_safe, HC|].
  split.
  { destruct (absent a) as [| |p|p]; cbn [finding_of]; [exact I|exact F|eapply no_plan;
      eassumption|].
    pose proof (volumes_true _ _ _ _ p HC F) as V. pose proof V as (_ & _ & _ & _ & W).
    destruct (volumes (scene a) p) as [[v w] all]. destruct W as (<- & <- & <-).
    split; [exact V|]. split; intros NZ; apply AnswerFacts.share_below, NZ. }
  do 6 (split; [reflexivity|]).
  split; [intros b Hb; exact (model_held _ _ _ b HC Hb)|]. split; [|exact (body_not_void _ _ _ HC)].
  intro Z. eapply K; [|exact S]. intros s. apply sample_of_something; [exact HC|].
  apply forallb_forall. intros b Hb. destruct (centred b) eqn:X; [reflexivity|].
  assert (In b (filter (fun B => negb (centred B)) (bins (around a)))) as Y by (apply filter_In;
    rewrite X; auto).
  apply length_zero_iff_nil in Z. rewrite Z in Y. destruct Y.
Qed.

(* ---- The claim: whether so many runs show what it says.  Read with ClaimSpec.v, which has the
   words ---- *)
From ParcJax Require Import ClaimSpec Claim.
From ParcJax Require Draws ClaimFacts TestedFacts.

(* N runs of one law, and whatever is said of them that holds only if some number leaves at most r
   of them outside of its tube, and that tube is left by more than e of all runs: it is as rare as
   the binomial sum says. *)
Definition claim_is_true : forall A (L : law A) (score : A -> option R), is_law L ->
  forall N r e (wrong : list A -> bool), 0 <= e <= 1 ->
  (forall l, wrong l = true -> exists s, (left_out score s l <= r)%nat /\
    e < prob L (leaves score s)) ->
  prob (draws L N) wrong <= tail N r e
  := fun A => @Draws.claim_is_true A.

(* The (r + 1)-th largest score of the runs is such a number. *)
Definition order_statistic : forall A (score : A -> option R) (l m : list A) r s, Permutation l m ->
  StronglySorted (fun a b => forall t, leaves score t b = true -> leaves score t a = true) m ->
  nth_error m r <> None -> (forall a, nth_error m r = Some a -> score a = Some s) ->
  (left_out score s l <= r)%nat
  := fun A => @Draws.order_statistic A.

(* From the law of the runs to the k that is driven: one of a set, or drawn W times as densely at
   most. *)
Definition risk_of_a_set : forall A (L : law A) (score : A -> option R), is_law L ->
  forall (chosen : A -> bool) s e,
  0 < prob L chosen -> prob L (leaves score s) <= e ->
  prob L (fun a => chosen a && leaves score s a) / prob L chosen <= e / prob L chosen
  := fun A => @Draws.risk_of_a_set A.
Definition risk_of_a_density : forall A (L : law A) (score : A -> option R) (M : law A) W s e,
  0 <= W -> prob L (leaves score s) <= e -> (forall E, prob M E <= W * prob L E) ->
  prob M (leaves score s) <= W * e
  := fun A => @Draws.risk_of_a_density A.

(* What is accepted: of what is said of its blocks, that any is wrong is no likelier than delta over
   the looks. *)
Definition claim_shown : forall A c (l : list (about A)), check_claim c = true ->
  Forall2 says l (blocks c) ->
  prob (all_draws l (blocks c)) (some_wrong l) <= Q2R (delta c) / IZR (Zpos (looks c))
  := fun A => @ClaimFacts.claim_shown A.
Definition bounds_shown : forall c, check_claim c = true ->
  blocks c <> [] /\ (forall b, In b (blocks c) -> 0 < Q2R (bound b) <= Q2R (eps c)) /\
    Q2R (eps c) <= 1 /\
  forall e, In (Some e) (in_bins c) -> exists b, In b (blocks c) /\ Q2R e = Q2R (bound b)
  := ClaimFacts.bounds_shown.

(* Of sets that are tested in some order with the same N runs, each with so many of them as it has:
   the checker says yes to the claim of one block that a test is.  That a set is accepted, as all
   before it were, in which a run fails more often than eps of all runs in it: no likelier than
   delta.  The sets and their order are fixed before the runs. *)
Definition sets_tested : forall A (L : law A) (fails : A -> bool) (sets : list (A -> bool)) N e d,
  is_law L -> 0 <= Q2R d ->
  let show n x :=
    (0 <? n)%nat && check_claim (Claim [Block (Pos.of_nat n) x e] 1 e d []) in
  prob (draws L N) (accepts_a_bad_one L fails (Q2R e) show sets) <= Q2R d
  := fun A => @TestedFacts.sets_tested A.

(* ---- Episodes (Episode.v has the words) ---- *)
(* Of a robot that, while each manoeuvre is under way, keeps to a trajectory in its tube, told from
   where it truly began, and rests at its end: at every time from the first begin on exactly one
   manoeuvre is under way, and no point of the body is in an obstacle of its problem that is there
   then, moved by what its pose was off by.  The body is one; the numbers are those of the
   manoeuvres, of the bins, and of those that leave out the model.  where_ i has places as
   manoeuvre i tells them: in the world, or in the frame of the robot as it was said to begin. *)
Definition accepted_episode : forall e n b w, check_episode e = Driven n b w ->
  (n = length (done e) /\ b = length (bins (its_tube e)) /\
   w = length (filter (fun B => negb (centred B)) (bins (its_tube e)))) /\
  exists m0, hd_error (done e) = Some m0 /\
  (forall m, In m (done e) -> parts (asked m) = parts (asked m0)) /\
  forall (u : nat -> rv) (where_ : nat -> R -> nat -> rv),
  (forall i turn, nth_error (turns (done e)) i = Some turn -> keeps_to e turn (u i) (where_ i)) ->
  forall time, Q2R (begin m0) <= time ->
  exists i turn, nth_error (turns (done e)) i = Some turn /\ under_way turn time /\
    (forall j other, nth_error (turns (done e)) j = Some other -> under_way other time -> j = i) /\
    clear_of e (fst turn) (fun a => u i a - toR (start_of e (fst turn)) a) (where_ i) time
  := EpisodeFacts.accepted_episode.
(* In the world, of poses that are off by no more than their doubt: no point of the body is in an
   obstacle less the box of that doubt, which is the obstacle that was grown by it. *)
Definition accepted_place : forall e n b w, check_episode e = Driven n b w -> turning e = false ->
  exists m0, hd_error (done e) = Some m0 /\
  (forall m, In m (done e) -> parts (asked m) = parts (asked m0)) /\
  forall where_ : R -> nat -> rv,
  (forall turn, In turn (turns (done e)) -> exists u,
     (forall a, (a < n_p (asked m0))%nat ->
       Rabs (u a - toR (pose (fst turn)) a) <= toR (doubt e) a) /\
     keeps_to e turn u where_) ->
  forall time, Q2R (begin m0) <= time ->
  exists turn, In turn (turns (done e)) /\ under_way turn time /\
    forall o t p x, In o (obstacles (asked (fst turn))) -> (first o <= t <= last o)%nat ->
      INR t <= clock e (fst turn) time <= INR (S t) -> In p (parts (asked m0)) ->
      inPart (n_p (asked m0)) p (where_ time) x -> ~ inPoly (less_a_box (doubt e) (rows o)) x
  := EpisodeFacts.accepted_place.
(* The same of a robot that turns, with headings as stated: a place of the world is never in the
   body if it is in an obstacle, as that is seen from the stated pose, when moved by any of the
   doubt. *)
Definition accepted_turning : forall e n b w, check_episode e = Driven n b w -> turning e = true ->
  exists m0, hd_error (done e) = Some m0 /\
  forall where_ : R -> nat -> rv,
  (forall turn, In turn (turns (done e)) -> exists v,
     (forall a, (a < n_p (asked m0))%nat ->
       Rabs (v a - toR (pose (fst turn)) a) <= toR (doubt e) a) /\
     keeps_to e turn (fun _ => 0)
       (fun time i => seen_from v (Q2R (heading (fst turn))) (where_ time i))) ->
  forall time, Q2R (begin m0) <= time ->
  exists turn v, In turn (turns (done e)) /\ under_way turn time /\
    (forall a, (a < n_p (asked m0))%nat ->
       Rabs (v a - toR (pose (fst turn)) a) <= toR (doubt e) a) /\
    forall o t p x, In o (obstacles (asked (fst turn))) -> (first o <= t <= last o)%nat ->
      INR t <= clock e (fst turn) time <= INR (S t) -> In p (parts (asked m0)) ->
      inPart (n_p (asked (fst turn))) p
        (fun i => seen_from v (Q2R (heading (fst turn))) (where_ time i))
        (seen_from v (Q2R (heading (fst turn))) x) ->
      ~ (forall d, (forall a, (a < n_p (asked m0))%nat -> Rabs (d a) <= toR (doubt e) a) ->
           inPoly (rows o) (seen_from (toR (pose (fst turn))) (Q2R (heading (fst turn)))
             (fun a => x a - d a)))
  := EpisodeFacts.accepted_turning.
(* The same where headings are off by no more than an angle, and three copies of each point keep to
   the tube, which maps have made whose triangle holds each such turn: the body is told by its own
   points. *)
Definition accepted_heading : forall e n b w, check_episode e = Driven n b w -> turning e = true ->
  exists m0, hd_error (done e) = Some m0 /\
  forall angle ca cb cg (where_ : R -> nat -> rv), hold_turns angle ca cb cg ->
  (forall turn, In turn (turns (done e)) -> exists v t, Rabs t <= angle /\
     (forall a, (a < n_p (asked m0))%nat ->
       Rabs (v a - toR (pose (fst turn)) a) <= toR (doubt e) a) /\
     keeps_to e turn (fun _ => 0) (fun time i => copy ca cb cg (i mod 3)
       (seen_from v (Q2R (heading (fst turn)) + t) (where_ time (i / 3)%nat)))) ->
  forall time, Q2R (begin m0) <= time ->
  exists turn v, In turn (turns (done e)) /\ under_way turn time /\
    (forall a, (a < n_p (asked m0))%nat ->
       Rabs (v a - toR (pose (fst turn)) a) <= toR (doubt e) a) /\
    forall o t p x, In o (obstacles (asked (fst turn))) -> (first o <= t <= last o)%nat ->
      INR t <= clock e (fst turn) time <= INR (S t) -> In (copied p) (parts (asked m0)) ->
      inPart (n_p (asked (fst turn))) p
        (fun i => seen_from v (Q2R (heading (fst turn))) (where_ time i))
        (seen_from v (Q2R (heading (fst turn))) x) ->
      ~ (forall d, (forall a, (a < n_p (asked m0))%nat -> Rabs (d a) <= toR (doubt e) a) ->
           inPoly (rows o) (seen_from (toR (pose (fst turn))) (Q2R (heading (fst turn)))
             (fun a => x a - d a)))
  := HeadingFacts.accepted_heading.
Definition turns_held : forall angle, 0 < angle < PI / 2 ->
  hold_turns angle (cos angle) (sin angle) (/ cos angle)
  := HeadingFacts.turns_held.
Definition a_drive_there_is : forall e n b w, check_episode e = Driven n b w ->
  forallb centred (bins (its_tube e)) = true ->
  exists where_ : nat -> R -> nat -> rv,
  forall i turn, nth_error (turns (done e)) i = Some turn ->
    keeps_to e turn (toR (start_of e (fst turn))) (where_ i)
  := EpisodeFacts.a_drive_there_is.

(* ---- The bytes of a file.  Read with Json.v and Format.v, which have the words ---- *)
From ParcJax Require Import Json Parse Format Reader.
From ParcJax Require ParseFacts ReaderFacts.

(* What the program reads from a file is the value of JSON that its bytes spell; it reads one where
   they spell one, and they spell one at most. *)
Definition parse_is : forall s v, (exists left, parse s = Read v left) <-> json_of s v
  := ParseFacts.parse_is.
Definition one_value : forall s v w, json_of s v -> json_of s w -> v = w
  := ParseFacts.one_value.
(* From the bytes of a file to what is true: the program calls these three, one after the other. *)
Theorem accepted_bytes : forall s v left a marks r, parse s = Read v left ->
  answer_of v = Fine a -> check_answer a = Accepted marks r ->
  json_of s v /\ answer_is v a /\ meaning a r.
Proof.
  intros s v left a marks r V A K. split; [apply parse_is; eauto|].
  split; [exact (ReaderFacts.answer_reads v a A)|exact (accepted a marks r K)].
Qed.
(* The same of an episode, as far as the record that check_episode is asked about. *)
Theorem episode_bytes : forall s v left e, parse s = Read v left -> episode_of v = Fine e ->
  json_of s v /\ episode_is v e.
Proof.
  intros s v left e V E. split; [apply parse_is; eauto|exact (ReaderFacts.episode_reads v e E)].
Qed.
