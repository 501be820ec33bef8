(* The leaves of a tree of splits tile its box; each k of a leaf lies in a bin that the leaf meets.
   *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia.
From ParcJax Require Import Spec Arithmetic Checker ArithmeticFacts BinFacts Doubt DoubtFacts
  NoPlan ListFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- Splitting one axis ---- *)
Definition cuts (B : area) (i : nat) (c : Q) : bool :=
  match nth_error B i with Some (lo, hi) => qlt lo c && qlt c hi | None => false end.
Lemma either_part B : forall i c x, inBox B x -> inBox (lower_part i c B) x \/
  inBox (upper_part i c B) x.
Proof.
  induction B as [|[lo hi] B IH]; intros i c x H; [left; destruct i; exact I|].
  destruct H as [H HB]. destruct i as [|i]; simpl.
  - destruct (Rle_dec (x O) (Q2R c)); [left|right]; (split; [lra|exact HB]).
  - destruct (IH i c (shift x) HB); [left|right]; auto.
Qed.
Lemma parts_inside B : forall i c x, cuts B i c = true ->
  (inBox (lower_part i c B) x -> inBox B x) /\ (inBox (upper_part i c B) x -> inBox B x) /\
  (inside (lower_part i c B) x -> inside B x) /\ (inside (upper_part i c B) x -> inside B x) /\
  ~ (inside (lower_part i c B) x /\ inside (upper_part i c B) x) /\
  volume (lower_part i c B) + volume (upper_part i c B) = volume B /\
  length (lower_part i c B) = length B /\ length (upper_part i c B) = length B.
Proof.
  unfold cuts. induction B as [|[lo hi] B IH]; intros i c x H; [destruct i; discriminate|].
  destruct i as [|i]; simpl in H.
  - apply andb_prop in H as [L U]. apply R_lt in L, U. simpl. repeat split; try (intros; simpl in *;
      try split; tauto || lra); lra || (intros [[? ?] [? ?]]; lra) || idtac.
  - destruct (IH i c (shift x) H) as (A1 & A2 & A3 & A4 & A5 & A6 & A7 & A8). simpl.
    repeat split; try tauto; try lia. rewrite <- A6. ring.
Qed.
Lemma leaves_in t : forall B C r, splits_ok B t = true -> In (C, r) (leaves B t) ->
  length C = length B /\ (forall x, inBox C x -> inBox B x) /\ (forall x, inside C x -> inside B x).
Proof.
  induction t as [r'|i c l IHl u IHu]; intros B C r H Hin; simpl in *.
  - destruct Hin as [[= <- _]|[]]. auto.
  - rewrite !andb_true_iff in H. destruct H as [[H Hl] Hu]. pose proof (fun x =>
      parts_inside B i c x H) as K.
    destruct (K (fun _ => 0)) as (_ & _ & _ & _ & _ & _ & K7 & K8).
    apply in_app_iff in Hin as [Hin|Hin].
    + destruct (IHl _ _ _ Hl Hin) as (L & S & O). split; [congruence|].
      split; intros x Hx; destruct (K x) as (K1 & K2 & K3 & K4 & _); auto.
    + destruct (IHu _ _ _ Hu Hin) as (L & S & O). split; [congruence|].
      split; intros x Hx; destruct (K x) as (K1 & K2 & K3 & K4 & _); auto.
Qed.
Lemma leaves_cover t : forall B x, inBox B x -> exists C r, In (C, r) (leaves B t) /\ inBox C x.
Proof.
  induction t as [r|i c l IHl u IHu]; intros B x H; simpl; [exists B, r; auto|].
  destruct (either_part B i c x H) as [K|K].
  - destruct (IHl _ _ K) as (C & r & Hin & HC). exists C, r. split; [apply in_or_app;
      auto|exact HC].
  - destruct (IHu _ _ K) as (C & r & Hin & HC). exists C, r. split; [apply in_or_app;
      auto|exact HC].
Qed.
Lemma pairs_app {A} (R : A -> A -> Prop) l m : ForallOrdPairs R l -> ForallOrdPairs R m ->
  (forall a b, In a l -> In b m -> R a b) -> ForallOrdPairs R (l ++ m).
Proof.
  intros Hl Hm H. induction Hl as [|a l Ha Hl IH]; [exact Hm|]. simpl. constructor.
  - apply Forall_app. split; [exact Ha|]. apply Forall_forall. intros b Hb. apply H; simpl; auto.
  - apply IH. intros; apply H; simpl; auto.
Qed.
Lemma total_app l m : total (l ++ m) = total l + total m.
Proof. induction l as [|B l IH]; simpl; [ring|]. rewrite IH. ring. Qed.
Theorem leaves_tile t : forall B, splits_ok B t = true -> tiles (map fst (leaves B t)) B.
Proof.
  intros B H. split; [|split; [|split]].
  - intros x Hx. destruct (leaves_cover t B x Hx) as (C & r & Hin & HC). exists C.
    split; [|exact HC].
    apply in_map_iff. exists (C, r). auto.
  - intros C HC x Hx. apply in_map_iff in HC as ([C' r] & <- & Hin).
    apply (leaves_in t B C' r H Hin). exact Hx.
  - revert B H. induction t as [r|i c l IHl u IHu]; intros B H; simpl in *; [repeat constructor|].
    rewrite !andb_true_iff in H. destruct H as [[H Hl] Hu]. rewrite map_app.
    apply pairs_app; [apply IHl, Hl|apply IHu, Hu|].
    intros C D HC HD x [XC XD]. apply in_map_iff in HC as ([C' r] & <- & HC).
    apply in_map_iff in HD as ([D' r'] & <- & HD).
    destruct (parts_inside B i c x H) as (_ & _ & _ & _ & K & _). apply K.
    split; [apply (leaves_in l _ _ _ Hl HC)|apply (leaves_in u _ _ _ Hu HD)]; assumption.
  - revert B H. induction t as [r|i c l IHl u IHu]; intros B H; simpl in *; [ring|].
    rewrite !andb_true_iff in H. destruct H as [[H Hl] Hu]. rewrite map_app, total_app, IHl,
      IHu by assumption.
    destruct (parts_inside B i c (fun _ => 0) H) as (_ & _ & _ & _ & _ & K & _). exact K.
Qed.
Lemma volumeQ_R B : Q2R (volumeQ B) = volume B.
Proof.
  induction B as [|[lo hi] B IH]; simpl; [apply R1|]. change (fold_right _ 1%Q B) with (volumeQ B).
  rewrite R_mul, R_add, Q2R_opp, IH. reflexivity.
Qed.
Lemma sum_of_R pick ls : Q2R (sum_of pick ls) = total (map fst (filter (fun l => pick (snd l)) ls)).
Proof.
  induction ls as [|[B r] ls IH]; simpl; [apply R0|]. change (fold_right _ 0%Q ls)
    with (sum_of pick ls).
  destruct (pick r); simpl; [rewrite R_add, volumeQ_R, IH; reflexivity|exact IH].
Qed.

(* ---- Boxes and prefixes ---- *)
Lemma inBox_app A : forall B x, inBox (A ++ B) x <-> inBox A x /\ inBox B (fun i =>
  x (length A + i)%nat).
Proof.
  induction A as [|[lo hi] A IH]; intros B x; simpl.
  - split; [intro H; split; [exact I|exact H]|intros [_ H]; exact H].
  - rewrite (IH B (shift x)). tauto.
Qed.
Lemma inside_app A : forall B x, inside (A ++ B) x <-> inside A x /\ inside B (fun i =>
  x (length A + i)%nat).
Proof.
  induction A as [|[lo hi] A IH]; intros B x; simpl.
  - split; [intro H; split; [exact I|exact H]|intros [_ H]; exact H].
  - rewrite (IH B (shift x)). tauto.
Qed.
Lemma inside_ext B : forall x y, (forall i, x i = y i) -> inside B x -> inside B y.
Proof.
  induction B as [|[lo hi] B IH]; intros x y E H; simpl in *; [exact I|]. rewrite <- E.
  split; [apply H|].
  apply (IH (shift x)); [intro i; apply E|apply H].
Qed.
Lemma inside_in B : forall x, inside B x -> inBox B x.
Proof. induction B as [|[lo hi] B IH]; intros x H; simpl in *; [exact I|]. destruct H as [H HB].
split; [lra|apply IH; exact HB]. Qed.

(* ---- A bin whose interior meets a thick box, around each of its k ---- *)
Lemma gap_met e : forall a lo hi v, (1 <= length e)%nat -> increasing (a :: e) = true ->
  Q2R a <= v -> Q2R a < Q2R hi -> Q2R hi <= Q2R (List.last (a :: e) a) -> Q2R lo < Q2R hi ->
    Q2R lo <= v <= Q2R hi ->
  exists c d, In (c, d) (gaps (a :: e)) /\ Q2R c <= v <= Q2R d /\ Q2R c < Q2R hi /\ Q2R lo < Q2R d.
Proof.
  induction e as [|b e IH]; intros a lo hi v L HI Hv Ha Hl Hlh Hb; [simpl in L; lia|].
  change (increasing (a :: b :: e)) with (qlt a b && increasing (b :: e)) in HI.
  apply andb_prop in HI as [AB HI]. apply R_lt in AB.
  change (gaps (a :: b :: e)) with ((a, b) :: gaps (b :: e)).
  change (List.last (a :: b :: e) a) with (List.last (b :: e) a) in Hl.
  rewrite (last_default e b a b) in Hl.
  destruct (Rlt_dec v (Q2R b)) as [C|C]; [exists a, b; simpl; split; [auto|lra]|].
  destruct (Rlt_dec (Q2R b) (Q2R hi)) as [D|D].
  - destruct e as [|b' e]; [simpl in Hl; lra|].
    destruct (IH b lo hi v ltac:(simpl; lia) HI ltac:(lra) D Hl Hlh Hb) as (c & d & Hin & K).
    exists c, d. split; [right; exact Hin|exact K].
  - exists a, b. split; [left; reflexivity|]. lra.
Qed.
Fixpoint ranges (D dom : area) : Prop :=                 (* thick, and within the domain, by axis *)
  match D, dom with
  | [], [] => True
  | (a, b) :: D', (c, d) :: dom' => Q2R c <= Q2R a /\ Q2R a < Q2R b /\ Q2R b <= Q2R d /\
    ranges D' dom'
  | _, _ => False
  end.
Lemma ranges_intro D : forall dom, thick D = true -> length D = length dom ->
  (forall x, inBox D x -> inBox dom x) -> ranges D dom.
Proof.
  induction D as [|[a b] D IH]; intros [|[c d] dom] T L H; simpl in *; try discriminate; [exact I|].
  apply andb_prop in T as [T1 T]. apply R_lt in T1.
  assert (M : exists y, inBox D y).
  { clear - T. induction D as [|[a b] D IH]; [exists (fun _ => 0); exact I|]. simpl in T.
    apply andb_prop in T as [T1 T].
    apply R_lt in T1. destruct (IH T) as [y Hy]. exists (fun i => match i with O => Q2R a | S j =>
      y j end). split; [lra|exact Hy]. }
  destruct M as [y Hy].
  assert (E : forall v x, inBox D x -> Q2R a <= v <= Q2R b -> Q2R c <= v <= Q2R d /\ inBox dom x).
  { intros v x Hx Hv. destruct (H (fun i => match i with O => v | S j => x j end)) as [K1 K2];
      [split; [exact Hv|exact Hx]|].
    split; [exact K1|exact K2]. }
  destruct (E (Q2R a) y Hy ltac:(lra)). destruct (E (Q2R b) y Hy ltac:(lra)).
  repeat split; try lra. apply IH; [exact T|lia|]. intros x Hx. apply (E (Q2R a) x Hx). lra.
Qed.
Lemma covers_met es : forall dom D x, covers es dom = true -> ranges D dom -> inBox D x ->
  exists b, In b (boxes es) /\ inBox b x /\ overlaps b D = true.
Proof.
  induction es as [|e es IH]; intros [|[lo hi] dom] [|[a b] D] x H R Hx; simpl in R;
    try contradiction; try discriminate.
  - exists []. simpl. auto.
  - destruct e as [|e0 [|e1 e]]; discriminate.
  - destruct e as [|e0 [|e1 e]]; try discriminate. cbn [covers] in H. rewrite !andb_true_iff in H.
    destruct H as [[[A B] C] F].
    destruct R as (R1 & R2 & R3 & R). destruct Hx as [Hv Hx]. apply R_le in B, C.
    destruct (IH dom D (shift x) F R Hx) as (bx & Hb & Hi & Ho).
    destruct (gap_met (e1 :: e) e0 a b (x O) ltac:(simpl; lia) A ltac:(lra) ltac:(lra) ltac:(lra) R2
      Hv) as (c & d & Hg & Hc & Hl & Hh).
    exists ((c, d) :: bx). split; [apply in_flat_map; exists (c, d); split; [exact Hg|apply in_map;
      exact Hb]|].
    split; [split; assumption|]. cbn [overlaps]. rewrite Ho, andb_true_r.
    assert (Q : forall p q, Q2R p < Q2R q -> qlt p q = true).
    { intros p q G. unfold qlt. destruct (Qle_bool q p) eqn:E; [|reflexivity].
      apply R_le in E. lra. }
    rewrite !Q by assumption. reflexivity.
Qed.
Lemma bin_met P E H D x : tube_ok P E = true -> ranges D (domain P) -> inBox D x ->
  exists B, In B (map fst (met (hinted E H) D)) /\ In B (bins E) /\ inBox (box B) x.
Proof.
  intros HE R Hx. apply tube_inv in HE as (C & L1 & L2). destruct (covers_met _ _ _ _ C R Hx)
    as (b & Hb & Hi & Ho).
  destruct (zip3_ex _ (intervals E) (finals E) b L1 L2 Hb) as (B & HB & <-). exists B.
  split; [|auto].
  destruct (hinted_ex E H B HB) as [h Hh]. apply in_map_iff. exists (B, h). split; [reflexivity|].
  apply filter_In. auto.
Qed.
Lemma inside_met D : forall A x, inside D x -> inBox A x -> overlaps A D = true.
Proof.
  induction D as [|[c d] D IH]; intros [|[a b] A] x HD HA; try reflexivity.
  destruct HD as [H1 HD], HA as [H2 HA].
  cbn [overlaps]. rewrite (IH A (shift x)) by assumption. rewrite andb_true_r.
  assert (Q : forall p q, Q2R p < Q2R q -> qlt p q = true).
  { intros p q G. unfold qlt. destruct (Qle_bool q p) eqn:E; [|reflexivity]. apply R_le in E. lra. }
  rewrite !Q by lra. reflexivity.
Qed.
