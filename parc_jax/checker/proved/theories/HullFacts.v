(* Weighted means over the points of a hull; products of hulls; the hulls of hidden values cover
   what a box of k gives. *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia.
From ParcJax Require Import Spec Arithmetic Checker ArithmeticFacts NetworkFacts ConditionFacts
  Doubt DoubtFacts NoPlan.
Import ListNotations.
Open Scope R_scope.

(* ---- Means ---- *)
Section Mean.
Context {A : Type}.
Fixpoint mean (mu : list R) (V : list A) (f : A -> R) : R :=
  match mu, V with l :: mu', v :: V' => l * f v + mean mu' V' f | _, _ => 0 end.
Lemma mean_plus mu : forall V f g, mean mu V (fun v => f v + g v) = mean mu V f + mean mu V g.
Proof. induction mu; intros [|v V] f g; simpl; try lra. rewrite IHmu. ring. Qed.
Lemma mean_scale mu : forall V c f, mean mu V (fun v => c * f v) = c * mean mu V f.
Proof. induction mu; intros [|v V] c f; simpl; try lra. rewrite IHmu. ring. Qed.
Lemma mean_ext mu : forall V f g, (forall v, In v V -> f v = g v) -> mean mu V f = mean mu V g.
Proof. induction mu; intros [|v V] f g H; simpl; try lra. rewrite (H v), (IHmu V f g); simpl; auto.
intros; apply H; simpl; auto. Qed.
Lemma mean_const mu : forall V c, length mu = length V -> mean mu V (fun _ =>
  c) = fold_right Rplus 0 mu * c.
Proof. induction mu; intros [|v V] c L; simpl in *; try discriminate; [ring|].
rewrite IHmu by lia. ring. Qed.
Lemma mean_zero mu : forall V, mean mu V (fun _ => 0) = 0.
Proof. induction mu; intros [|v V]; simpl; try lra. rewrite IHmu. ring. Qed.
Lemma mean_le mu : forall V f g, Forall (fun l => 0 <= l) mu -> (forall v, In v V -> f v <= g v) ->
  mean mu V f <= mean mu V g.
Proof.
  induction mu as [|l mu IH]; intros [|v V] f g Hp H; simpl; try lra.
  apply Forall_cons_iff in Hp as [Hl Hp].
  assert (l * f v <= l * g v) by (apply Rmult_le_compat_l; [assumption|apply H; simpl; auto]).
  specialize (IH V f g Hp ltac:(intros; apply H; simpl; auto)). lra.
Qed.
Lemma mean_lt mu : forall V f g, length mu = length V -> Forall (fun l => 0 <= l) mu ->
  0 < fold_right Rplus 0 mu ->
  (forall v, In v V -> f v < g v) -> mean mu V f < mean mu V g.
Proof.
  induction mu as [|l mu IH]; intros [|v V] f g L Hp S H; simpl in *; try discriminate; try lra.
  apply Forall_cons_iff in Hp as [Hl Hp].
  assert (Hv : f v < g v) by (apply H; auto).
  assert (Ht : forall w, In w V -> f w < g w) by (intros; apply H; auto).
  destruct (Rle_lt_or_eq_dec 0 l Hl) as [P|<-].
  - assert (l * f v < l * g v) by (apply Rmult_lt_compat_l; assumption).
    pose proof (mean_le mu V f g Hp (fun w Hw => Rlt_le _ _ (Ht w Hw))). lra.
  - specialize (IH V f g ltac:(lia) Hp ltac:(lra) Ht). lra.
Qed.
Lemma mean_dot mu V w : forall (y : A -> rv), dotR w (fun a => mean mu V (fun v => y v a)) = mean mu
  V (fun v => dotR w (y v)).
Proof.
  induction w as [|c w IH]; intros y; simpl; [symmetry; apply mean_zero|].
  change (shift (fun a => mean mu V (fun v => y v a))) with (fun a => mean mu V (fun v =>
    shift (y v) a)).
  rewrite IH, mean_plus, mean_scale. reflexivity.
Qed.
Lemma mean_square mu V f : weights mu (length V) -> mean mu V f * mean mu V f <= mean mu V (fun v =>
  f v * f v).
Proof.
  intros (L & Hp & S). set (m := mean mu V f).
  assert (0 <= mean mu V (fun v => f v * f v + (-2 * m * f v + m * m))) as H.
  { rewrite <- (mean_zero mu V). apply mean_le; [exact Hp|]. intros v _.
    pose proof (Rle_0_sqr (f v - m)) as Q. unfold Rsqr in Q. lra. }
  rewrite !mean_plus, mean_scale, mean_const, S in H by exact L. fold m in H. lra.
Qed.
Lemma mean_sumsq mu V n : weights mu (length V) -> forall (y : A -> rv),
  sumsq n (fun a => mean mu V (fun v => y v a)) <= mean mu V (fun v => sumsq n (y v)).
Proof.
  intro W. induction n as [|n IH]; intro y; simpl; [rewrite mean_zero; lra|].
  rewrite mean_plus. apply Rplus_le_compat; [apply (mean_square mu V (fun v => y v O) W)|].
  apply (IH (fun v => shift (y v))).
Qed.
Lemma mean_abs mu V f c : weights mu (length V) -> (forall v, In v V -> Rabs (f v) <= c) ->
  Rabs (mean mu V f) <= c.
Proof.
  intros (L & Hp & S) H. pose proof (mean_const mu V c L) as C. pose proof (mean_const mu V (- c) L)
    as D. rewrite S in C, D.
  apply Rabs_le. split; [replace (- c) with (mean mu V (fun _ => - c)) by lra|replace c
    with (mean mu V (fun _ => c)) by lra];
  apply mean_le; auto; intros v Hv; specialize (H v Hv); unfold Rabs in H;
    destruct (Rcase_abs (f v)); lra.
Qed.
End Mean.

(* ---- A point of a hull is a mean of its points ---- *)
Lemma add_at (l : R) V v : In v V -> forall mu, length mu = length V -> Forall (fun x =>
  0 <= x) mu -> 0 <= l ->
  exists nu, length nu = length V /\ Forall (fun x => 0 <= x) nu /\
    fold_right Rplus 0 nu = fold_right Rplus 0 mu + l /\
  forall f : vec -> R, mean nu V f = mean mu V f + l * f v.
Proof.
  induction V as [|u V IH]; intros Hv [|m mu] L Hp Hl; try destruct Hv; try discriminate.
  - subst. apply Forall_cons_iff in Hp as [Hm Hp]. exists (m + l :: mu). simpl. repeat split; auto;
      [constructor; [lra|assumption]|ring|intro; ring].
  - apply Forall_cons_iff in Hp as [Hm Hp]. destruct (IH H mu ltac:(simpl in L; lia) Hp Hl)
      as (nu & Ln & Pn & Sn & Mn).
    exists (m :: nu). simpl. repeat split; [lia|constructor; assumption|rewrite Sn; ring|intro;
      rewrite Mn; ring].
Qed.
Lemma cone_mean V x w : cone V x w -> exists mu, length mu = length V /\ Forall (fun l =>
  0 <= l) mu /\
  fold_right Rplus 0 mu = w /\ forall i, x i = mean mu V (fun v => toR v i).
Proof.
  induction 1 as [x w Z W|v l x w y w' Hv Hl H (mu & L & P & S & M) Hy W].
  - exists (map (fun _ => 0) V). rewrite map_length. repeat split; auto.
    + clear. induction V; simpl; constructor; auto; lra.
    + rewrite W. clear. induction V; simpl; lra.
    + intro i. rewrite Z. clear. induction V; simpl; lra.
  - destruct (add_at l V v Hv mu L P Hl) as (nu & Ln & Pn & Sn & Mn). exists nu.
    repeat split; auto; [lra|].
    intro i. rewrite Hy, M, Mn. reflexivity.
Qed.
Lemma hull_mean V x : cone V x 1 -> exists mu, weights mu (length V) /\
  forall i, x i = mean mu V (fun v => toR v i).
Proof. intro H. destruct (cone_mean V x 1 H) as (mu & L & P & S & M). exists mu.
repeat split; auto. Qed.

(* ---- Products: corners of a box of z with points of a hull ---- *)
Definition join (n : nat) (x y : rv) : rv := fun i => if (i <? n)%nat then x i else y (i - n)%nat.
Lemma toR_app u v i : toR (u ++ v) i = join (length u) (toR u) (toR v) i.
Proof.
  unfold toR, join. destruct (Nat.ltb_spec i (length u)) as [H|H];
    [rewrite app_nth1 by exact H|rewrite app_nth2 by exact H]; reflexivity.
Qed.
Definition product (U V : list vec) : list vec := flat_map (fun v => map (fun u => u ++ v) U) V.
Lemma in_product U V u v : In u U -> In v V -> In (u ++ v) (product U V).
Proof. intros. apply in_flat_map. exists v. split; [assumption|]. apply in_map_iff. eauto. Qed.
Lemma cone_product n U V x : (forall u, In u U -> length u = n) -> cone U x 1 ->
  forall y w, cone V y w ->
  cone (product U V) (join n (fun i => w * x i) y) w.
Proof.
  intros Hn Hx y w H. induction H as [y w Z W|v l y w z w1 Hv Hl H IH Hz W].
  - apply cone_none; [|exact W]. intro i. unfold join. destruct (i <? n)%nat; [rewrite W;
      ring|apply Z].
  - assert (G : cone (product U V) (join n x (toR v)) 1).
    { clear - Hn Hx Hv. assert (forall w x, cone U x w -> cone (product U V) (join n x (fun i =>
        w * toR v i)) w) as K.
      { intros w x' H. induction H as [x' w Z W|u l x' w z w1 Hu Hl H IH Hz W].
        - apply cone_none; [|exact W]. intro i. unfold join. destruct (i <? n)%nat;
            [apply Z|rewrite W; ring].
        - apply (cone_more _ (u ++ v) l _ w _ w1 (in_product U V u v Hu Hv) Hl IH); [|exact W].
          intro i. rewrite toR_app, (Hn u Hu). unfold join. destruct (i <? n)%nat;
            [apply Hz|rewrite W; ring]. }
      apply (cone_ext _ _ _ _ _ (K 1 x Hx)); [|reflexivity]. intro i. unfold join.
      destruct (i <? n)%nat; ring. }
    apply (cone_ext _ _ _ _ _ (cone_add _ _ _ _ _ IH (cone_scale _ l _ _ Hl G)));
      [|rewrite W; ring].
    intro i. unfold join. destruct (i <? n)%nat; [rewrite W; ring|symmetry; apply Hz].
Qed.
Lemma corners_len D : forall v, In v (corners_of D) -> length v = length D.
Proof.
  induction D as [|[lo hi] D IH]; intros v H; simpl in H; [destruct H as [<-|[]]; reflexivity|].
  apply in_flat_map in H as (u & Hu & [<-|[<-|[]]]); simpl; f_equal; apply IH; exact Hu.
Qed.

(* ---- One layer, where no neuron changes its sign ---- *)
Fixpoint stateR (Ls : list layer) (x : rv) : rv :=
  match Ls with L :: Ls' => match Ls' with [] => x | _ => stateR Ls' (reluR (layerR L x)) end |
    [] => x end.
Lemma state_net Ls : forall x i, Ls <> [] -> netR Ls x i = layerR (last_layer Ls) (stateR Ls x) i.
Proof.
  induction Ls as [|L Ls IH]; intros x i H; [contradiction|]. destruct Ls as [|L' Ls];
    [reflexivity|].
  change (netR (L :: L' :: Ls) x) with (netR (L' :: Ls) (reluR (layerR L x))).
  rewrite IH by discriminate. reflexivity.
Qed.
Definition onward (L : layer) (v : vec) : vec := reluQ (layerQ L v).
Lemma onward_R L v i : toR (onward L v) i = reluR (layerR L (toR v)) i.
Proof. unfold onward. rewrite reluQ_R. unfold reluR. rewrite layerQ_R. reflexivity. Qed.
Lemma layer_cone L V x w : steady L V = true -> cone V x w ->
  cone (map (onward L) V) (fun i => match nth_error L i with Some (a, b) =>
    Rmax 0 (dotR a x + Q2R b * w) | None => 0 end) w.
Proof.
  intros HS H. induction H as [x w Z W|v l x w y w' Hv Hl H IH Hy W].
  - apply cone_none; [|exact W]. intro i. destruct (nth_error L i) as [[a b]|]; [|reflexivity].
    rewrite (dotR_ext a x (fun _ => 0)), dotR_zero, W by (intros; apply Z). rewrite Rmax_left; lra.
  - apply (cone_more _ (onward L v) l _ w _ w' (in_map _ _ _ Hv) Hl IH); [|exact W].
    intro i. rewrite onward_R. unfold reluR, layerR. destruct (nth_error L i) as [[a b]|] eqn:E;
      [|rewrite Rmax_left; lra].
    rewrite (dotR_ext a y (fun j => x j + l * toR v j)) by (intros; apply Hy).
    rewrite (dotR_plus a x), dotR_mult, W.
    apply nth_error_In in E. eapply forallb_forall in HS; [|exact E]. apply orb_prop in HS as [S|S].
    + assert (F : forall v, In v V -> 0 <= Q2R b + dotR a (toR v)).
      { intros u Hu. eapply forallb_forall in S; [|exact Hu]. apply R_le in S.
        rewrite R0, value_R in S. simpl in S. lra. }
      pose proof (cone_positive V (Q2R b) a x w H F). specialize (F v Hv).
      assert (0 <= l * (dotR a (toR v) + Q2R b)) by (apply Rmult_le_pos; lra).
      rewrite !Rmax_right; lra.
    + assert (F : forall v, In v V -> 0 <= Q2R (- b) + dotR (vscale (-1) a) (toR v)).
      { intros u Hu. eapply forallb_forall in S; [|exact Hu]. apply R_le in S.
        rewrite R0, value_R in S. simpl in S.
        rewrite dotR_vscale, Rm1, Q2R_opp. lra. }
      pose proof (cone_positive V (Q2R (- b)) (vscale (-1) a) x w H F) as C. specialize (F v Hv).
      rewrite dotR_vscale, Rm1, Q2R_opp in C, F.
      assert (0 <= l * (- (dotR a (toR v) + Q2R b))) by (apply Rmult_le_pos; lra).
      rewrite !Rmax_left; lra.
Qed.
Lemma hidden_cover Ls : forall V x, cone V x 1 ->
  exists ok W, In (ok, W) (hidden Ls V) /\ (ok = true -> cone W (stateR Ls x) 1).
Proof.
  induction Ls as [|L Ls IH]; intros V x H; [exists true, V; simpl; auto|].
  destruct Ls as [|L' Ls]; [exists true, V; simpl; auto|].
  destruct (split_layer_cover L V x H) as (b & W & Hin & HW).
  change (hidden (L :: L' :: Ls) V) with (flat_map (fun c => if steady L (snd c)
    then hidden (L' :: Ls) (map (onward L) (snd c)) else [(false, [])]) (split_layer L V)).
  change (stateR (L :: L' :: Ls) x) with (stateR (L' :: Ls) (reluR (layerR L x))).
  destruct (steady L W) eqn:S.
  - destruct (IH (map (onward L) W) (reluR (layerR L x))) as (ok & U & Hu & HU).
    + apply (cone_ext _ _ _ _ _ (layer_cone L W x 1 S HW)); [|reflexivity]. intro i.
      unfold reluR, layerR.
      destruct (nth_error L i) as [[a c]|]; [f_equal; ring|rewrite Rmax_left; lra].
    + exists ok, U. split; [|exact HU]. apply in_flat_map. exists (b, W). simpl snd.
      rewrite S. auto.
  - exists false, []. split; [|discriminate]. apply in_flat_map. exists (b, W). simpl snd.
    rewrite S. simpl. auto.
Qed.
Lemma net_inputs Ls w o x y : net_ok w Ls o = true -> (forall i, (i < w)%nat -> x i = y i) ->
  forall i, netR Ls x i = netR Ls y i.
Proof.
  intros H E. destruct Ls as [|L Ls]; [discriminate|]. cbn [net_ok] in H.
  apply andb_prop in H as [H _].
  assert (F : forall i, layerR L x i = layerR L y i).
  { intro i. unfold layerR. destruct (nth_error L i) as [[a b]|] eqn:G; [|reflexivity]. f_equal.
    apply nth_error_In in G.
    eapply forallb_forall in H; [|exact G]. apply Nat.eqb_eq in H. simpl in H. apply dotR_ext.
    intros; apply E. lia. }
  intro i. simpl. destruct Ls as [|L' Ls]; [apply F|]. apply netR_ext. intro j. unfold reluR.
  rewrite F. reflexivity.
Qed.
Lemma last_layer_ok Ls : forall w o, net_ok w Ls o = true ->
  exists v, forallb (fun r => Nat.eqb (length (fst r)) v) (last_layer Ls) = true /\
    length (last_layer Ls) = o.
Proof.
  induction Ls as [|L Ls IH]; intros w o H; [discriminate|]. cbn [net_ok] in H.
  apply andb_prop in H as [A B].
  destruct Ls as [|L' Ls]; [exists w; split; [exact A|apply Nat.eqb_eq; exact B]|].
  apply (IH _ _ B).
Qed.
