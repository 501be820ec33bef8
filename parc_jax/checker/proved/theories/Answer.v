(* The checker of a whole answer.  Nothing here has to be believed, but for what an answer holds:
   `accepted` in Statements.v says what is true of an answer that is accepted. *)
From Coq Require Import ZArith QArith List Bool Arith.
From ParcJax Require Import Spec Arithmetic Integers Checker Polytopes Doubt NoPlan.
Import ListNotations.
Open Scope Q_scope.

(* ---- What a file holds: the question, and what it claims.  None: an entry that could not be read
   ---- *)
Inductive absence := Unclaimed | Unread | Proved (p : proof) | Bracket (p : proof).
Record answer := Answer {
  scene : problem; net : list layer; around : tube; hints : list goal_hints;
  samples : list (option sample); sets : list (option piece); corridors : list (option sample);
  doubts : list (option boxed); absent : absence }.

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
    let in_sets := marked (check_set_with (whole_of N E) P N E H) (sets a) in
    let in_corridors := marked (check_sample P N E H) (corridors a) in
    let in_doubts := marked (check_box P N E H) (doubts a) in
    let marks := [in_samples; in_sets; in_corridors; in_doubts; check_absence P N E H (absent a)] in
    if forallb (forallb (fun ok => ok)) marks then
      Accepted marks (Report
        (length (samples a)) (length (sets a)) (length (corridors a)) (length (doubts a))
        (finding_of P (absent a))
        (length (bins E)) (length (filter (fun B => negb (centred B)) (bins E))))
    else Refused marks
  else Misfit.
