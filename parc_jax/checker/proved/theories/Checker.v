(* The checker that runs.  Nothing here has to be believed: Theorems.v says what its answer `true`
   means. *)
From Coq Require Import ZArith QArith Qabs List Bool Arith.
From ParcJax Require Import Spec Arithmetic.
Import ListNotations.
Open Scope Q_scope.

(* ---- The network: at a point, and as affine forms where a pattern says which neurons pass ---- *)
Definition layerQ (L : layer) (x : vec) : vec := map (fun r => qadd (dotQ (fst r) x) (snd r)) L.
Definition reluQ (x : vec) : vec := map (fun a => if qle 0 a then a else 0) x.
Fixpoint netQ (Ls : list layer) (x : vec) : vec :=
  match Ls with
  | [] => x
  | L :: Ls' => match Ls' with [] => layerQ L x | _ => netQ Ls' (reluQ (layerQ L x)) end
  end.
Definition layerA (L : layer) (X : list aff) : list aff := map (fun r =>
  aadd (lincomb (fst r) X) (aconst (snd r))) L.
Fixpoint passA (bits : list bool) (X : list aff) : list aff :=
  match bits, X with b :: bits', f :: X' => (if b then f else aconst 0) :: passA bits' X' | _,
    _ => [] end.
Fixpoint signs (bits : list bool) (X : list aff) : list row :=
  match bits, X with b :: bits', f :: X' => (false, if b then f else aneg f) :: signs bits' X' | _,
    _ => [] end.
Fixpoint netA (Ls : list layer) (bits : list (list bool)) (X : list aff) : list row * list aff :=
  match Ls with
  | [] => ([], X)
  | L :: Ls' => match Ls' with
    | [] => ([], layerA L X)
    | _ => let Z := layerA L X in let b := hd [] bits in
           let (r, Y) := netA Ls' (tl bits) (passA b Z) in (signs b Z ++ r, Y)
    end
  end.
Fixpoint bits_ok (Ls : list layer) (bits : list (list bool)) : bool :=
  match Ls, bits with
  | [_], [] => true
  | L :: Ls', b :: bits' => Nat.eqb (length b) (length L) && bits_ok Ls' bits'
  | _, _ => false
  end.

(* ---- How far errors and bodies reach in a direction ---- *)

(* Guesses of multipliers m of the rows of A with sum m_i a_i = w, in the plane and in space by
   Cramer's rule from two or three rows.  They are tried, so nothing about them is proved; elsewhere
   a certificate has to bring them. *)
Definition qdiv (a b : Q) : Q := red (a / b).
Definition det2 (a b : vec) : Q := nth 0 a 0 * nth 1 b 0 - nth 1 a 0 * nth 0 b 0.
Definition det3 (a b c : vec) : Q :=
  nth 0 a 0 * det2 (tl b) (tl c) - nth 0 b 0 * det2 (tl a) (tl c) + nth 0 c 0 * det2 (tl a) (tl b).
Fixpoint pairs {A} (l : list A) : list (A * A) :=
  match l with [] => [] | x :: l' => map (pair x) l' ++ pairs l' end.
Fixpoint triples {A} (l : list A) : list (A * (A * A)) :=
  match l with [] => [] | x :: l' => map (pair x) (pairs l') ++ triples l' end.
Definition guesses (A : poly) (w : vec) : list multipliers :=
  let numbered := combine (seq 0 (length A)) (map fst A) in
  match length w with
  | 1%nat => map (fun a => [(fst a, qdiv (nth 0 w 0) (nth 0 (snd a) 0))]) numbered
  | 2%nat => map (fun ab => let '((i, a), (j, b)) := ab in let d := det2 a b in
                            [(i, qdiv (det2 w b) d); (j, qdiv (det2 a w) d)]) (pairs numbered)
  | 3%nat => map (fun abc => let '((i, a), ((j, b), (l, c))) := abc in let d := det3 a b c in
                             [(i, qdiv (det3 w b c) d); (j, qdiv (det3 a w c) d);
                               (l, qdiv (det3 a b w) d)])
                 (triples numbered)
  | _ => []
  end.
Definition positive (m : multipliers) : bool := forallb (fun im => qle 0 (snd im)) m.
Fixpoint least (A : poly) (w : vec) (tries : list multipliers) : option Q :=
  match tries with
  | [] => None
  | m :: tries' =>
      let best := least A w tries' in
      if positive m then
        let (v, h) := combine_rows A m in
        if same v w then match best with Some g => if qle g h then best else Some h | None =>
          Some h end else best
      else best
  end.
(* at least max of w . x over E *)
Definition reach (E : error) (hints : list multipliers) (w : vec) : option Q :=
  match E with Widths e => Some (dotQ (vabs w) e) | Rows A => least A w (hints ++ guesses A w) end.
(* at least max of -w . x *)
Definition support (b : shape) (w : vec) : Q :=
  match b with
  | Disc r => qmul r (root_up (dotQ w w))
  | Hull [] => 0
  | Hull (v :: vs) => fold_right (fun u acc => let s := - dotQ w u in if qle acc s then s else acc)
    (- dotQ w v) vs
  end.

(* ---- Separating directions: multipliers of an obstacle's rows, one run of intervals after the
   other ---- *)
(* until which interval (exclusive), multipliers *)
Definition run := (nat * multipliers)%type.
(* the same, direction w, offset of the grown obstacle *)
Definition dir := (nat * (vec * Q))%type.
Definition sepn := list (list (list run)).              (* by obstacle, by part of the body *)
(* an obstacle and the part that has to keep clear of it *)
Definition task := (obstacle * part)%type.
Definition tasks (P : problem) : list task := flat_map (fun o => map (pair o) (parts P))
  (obstacles P).
Definition dir_of (b : task) (r : run) : dir :=
  let (w, h) := combine_rows (rows (fst b)) (snd r) in (fst r,
    (w, qadd h (support (grown_by (snd b)) w))).
Definition dirs_of (P : problem) (sep : sepn) : list (list dir) :=
  map (fun br => map (dir_of (fst br)) (snd br)) (combine (tasks P) (concat sep)).
Fixpoint runs_ok (n : nat) (o : obstacle) (t : nat) (rs : list run) : bool :=
  match rs with
  | [] => Nat.eqb t (S (last o))
  | r :: rs' => (t <? fst r)%nat && (fst r <=? S (last o))%nat &&
      forallb (fun im => (fst im <? length (rows o))%nat) (snd r) && positive (snd r) &&
      nonzero (fst (combine_rows (rows o) (snd r))) &&
      Nat.eqb (length (fst (combine_rows (rows o) (snd r)))) n && runs_ok n o (fst r) rs'
  end.
Definition sep_ok (P : problem) (sep : sepn) : bool :=
  Nat.eqb (length sep) (length (obstacles P)) &&
  forallb (fun runs => Nat.eqb (length runs) (length (parts P))) sep &&
  Nat.eqb (length (concat sep)) (length (tasks P)) &&
  forallb (fun br => runs_ok (n_p P) (fst (fst br)) (first (fst (fst br))) (snd br)) (combine (tasks
    P) (concat sep)).
Fixpoint dir_at (ds : list dir) (t : nat) : option (vec * Q) :=
  match ds with [] => None | (stop, d) :: ds' => if (t <? stop)%nat then Some d
    else dir_at ds' t end.

(* ---- What makes a plan safe in a bin, as rows in whatever variables p0 (forms X) and the outputs
   (forms Y) use ---- *)
Fixpoint chunk {A} (n T : nat) (Y : list A) : list (list A) :=
  match T with O => [] | S T' => firstn n Y :: chunk n T' (skipn n Y) end.
Definition padded (P : problem) (Y : list aff) : list aff := repeat (aconst 0) (n_p P) ++ Y.
(* point i at knot t is number t n_points + i *)
Definition places (P : problem) (X Y : list aff) : list (list aff) :=
  map (zadd X) (chunk (n_p P) (S (steps P) * n_points P) (padded P Y)).
Definition extrasA (P : problem) (Y : list aff) : list aff :=
  firstn (n_q P) (skipn (S (steps P) * (n_points P * n_p P)) (padded P Y)).
Definition endA (P : problem) (K : list (list aff)) (Y : list aff) : list aff :=
  concat (firstn (n_points P) (skipn (steps P * n_points P) K)) ++ extrasA P Y.

Definition below (A : poly) (bound : nat -> vec -> option Q) (X : list aff) : list row :=
  map (fun iab => let '(i, (a, b)) := iab in
         match bound i a with
         | None => never
         | Some r => (false, aadd (aconst (qadd b (- r))) (aneg (lincomb a X)))
         end) (combine (seq 0 (length A)) A).
Definition apart (w : vec) (h : Q) (X : list aff) : row :=
  (true, aadd (lincomb w X) (aconst (- h))).
Definition clear_at (P : problem) (B : bin) (K : list (list aff)) (wh : vec * Q) (t i :
  nat) : list row :=
  let (w, h) := wh in
  match reach (nth i (nth t (interval B) []) (Rows [])) [] (vscale (-1) w) with
  | None => [never]
  | Some r => let g := qadd h r in
      [apart w g (nth (t * n_points P + i) K []); apart w g (nth (S t * n_points P + i) K [])]
  end.
Definition clear (P : problem) (B : bin) (K : list (list aff)) (b : task) (ds :
  list dir) : list row :=
  flat_map (fun t => match dir_at ds t with
                     | None => [never]
                     | Some wh => flat_map (clear_at P B K wh t) (corners (snd b))
                     end) (seq (first (fst b)) (S (last (fst b)) - first (fst b))).
(* per goal row: ways to bound the error of the end *)
Definition goal_hints := list (list multipliers).
Definition conditions (P : problem) (ds : list (list dir)) (B : bin) (H : goal_hints) (X Y :
  list aff) : list row :=
  let K := places P X Y in
  below (start P) (fun _ _ => Some 0) X ++
  below (goal P) (fun i a => reach (final B) (nth i H []) a) (endA P K Y) ++
  flat_map (fun bd => clear P B K (fst bd) (snd bd)) (combine (tasks P) ds).

(* The same, going along the intervals with the lists instead of into them. *)
Definition clear_here (Es : list error) (K K' : list (list aff)) (wh : vec * Q) (i : nat)
  : list row :=
  let (w, h) := wh in
  match reach (nth i Es (Rows [])) [] (vscale (-1) w) with
  | None => [never]
  | Some r => let g := qadd h r in [apart w g (nth i K []); apart w g (nth i K' [])]
  end.
Fixpoint clear_on (P : problem) (Is : list (list error)) (K : list (list aff)) (points : list nat)
  (ds : list dir) (t n : nat) : list row :=
  match n with
  | O => []
  | S n' =>
      let K' := skipn (n_points P) K in
      match dir_at ds t with
      | None => [never]
      | Some wh => flat_map (clear_here (hd [] Is) K K' wh) points
      end ++ clear_on P (tl Is) K' points ds (S t) n'
  end.
Definition conditions_on (P : problem) (ds : list (list dir)) (B : bin) (H : goal_hints) (X Y :
  list aff) : list row :=
  let K := places P X Y in
  below (start P) (fun _ _ => Some 0) X ++
  below (goal P) (fun i a => reach (final B) (nth i H []) a) (endA P K Y) ++
  flat_map (fun bd => let t := first (fst (fst bd)) in
    clear_on P (skipn t (interval B)) (skipn (t * n_points P) K) (corners (snd (fst bd)))
      (snd bd) t (S (last (fst (fst bd))) - t)) (combine (tasks P) ds).

(* ---- Shapes and sizes ---- *)
Definition poly_ok n (A : poly) := forallb (fun ab => Nat.eqb (length (fst ab)) n) A.
Definition shape_ok n (b : shape) :=
  match b with Disc r => qle 0 r | Hull vs => negb (Nat.eqb (length vs) 0) && forallb (fun v =>
    Nat.eqb (length v) n) vs end.
Definition part_ok P (b : part) :=
  shape_ok (n_p P) (grown_by b) && negb (Nat.eqb (length (corners b)) 0) &&
  forallb (fun i => i <? n_points P)%nat (corners b).
Fixpoint net_ok (width : nat) (Ls : list layer) (out : nat) : bool :=
  match Ls with
  | [] => false
  | L :: Ls' => forallb (fun r => Nat.eqb (length (fst r)) width) L &&
                match Ls' with [] => Nat.eqb (length L) out | _ => net_ok (length L) Ls' out end
  end.
Definition outputs (P : problem) := (S (steps P) * (n_points P * n_p P) - n_p P + n_q P)%nat.
Definition problem_ok (P : problem) (N : list layer) : bool :=
  (0 <? n_p P)%nat && (0 <? n_points P)%nat && (0 <? steps P)%nat &&
  poly_ok (n_points P * n_p P + n_q P) (goal P) && poly_ok (n_p P) (start P) &&
  forallb (fun o => poly_ok (n_p P) (rows o) && (first o <=? last o)%nat && (last o <? steps P)%nat)
    (obstacles P) &&
  negb (Nat.eqb (length (parts P)) 0) && forallb (part_ok P) (parts P) &&
  net_ok (n_k P) N (outputs P) && Nat.eqb (length (domain P)) (n_k P) &&
  forallb (fun d => qle (fst d) (snd d)) (domain P).
Definition error_ok n (E : error) : bool :=
  match E with Widths e => Nat.eqb (length e) n && forallb (qle 0) e | Rows A => poly_ok n A end.
Definition bin_ok (P : problem) (B : bin) : bool :=
  Nat.eqb (length (interval B)) (steps P) &&
  forallb (fun Es => Nat.eqb (length Es) (n_points P) && forallb (error_ok (n_p P)) Es)
    (interval B) &&
  error_ok (n_points P * n_p P + n_q P) (final B).
Fixpoint increasing (e : vec) : bool :=
  match e with a :: (b :: _) as e' => qlt a b && increasing e' | _ => true end.
(* at least two edges per axis: one bin *)
Fixpoint covers (es : list vec) (D : list (Q * Q)) : bool :=
  match es, D with
  | [], [] => true
  | (a :: b :: _) as e :: es', (lo, hi) :: D' => increasing e && qle a lo &&
    qle hi (List.last e a) && covers es' D'
  | _, _ => false
  end.
Definition tube_ok (P : problem) (E : tube) : bool :=
  covers (edges E) (domain P) && Nat.eqb (length (intervals E)) (length (boxes (edges E))) &&
  Nat.eqb (length (finals E)) (length (boxes (edges E))) && forallb (bin_ok P) (bins E).
Definition context_ok P N E := problem_ok P N && tube_ok P E.

(* ---- Samples, and corridors by their plan: the conditions hold in every closed bin that contains
   k ---- *)
Record sample := Sample { sample_p0 : vec; sample_k : vec; sample_sep : sepn }.
Definition hinted (E : tube) (H : list goal_hints) : list (bin * goal_hints) :=
  combine (bins E) (H ++ repeat [] (length (bins E))).
Definition check_sample (P : problem) (N : list layer) (E : tube) (H : list goal_hints) (s :
  sample) : bool :=
  Nat.eqb (length (sample_p0 s)) (n_p P) && Nat.eqb (length (sample_k s)) (n_k P) &&
    inBoxQ (domain P) (sample_k s) && sep_ok P (sample_sep s) &&
  let X := map aconst (sample_p0 s) in
  let Y := map aconst (netQ N (sample_k s)) in
  let ds := dirs_of P (sample_sep s) in
  forallb (fun BH => forallb (holdsQ []) (conditions_on P ds (fst BH) (snd BH) X Y))
          (filter (fun BH => inBoxQ (box (fst BH)) (sample_k s)) (hinted E H)).
