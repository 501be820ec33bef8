(* The reader of JSON finds the value that a text spells (Json.v), where it spells one; so it spells
   one at most. *)
From Coq Require Import Ascii String List Bool Arith NArith Lia Permutation.
From ParcJax Require Import Json Parse.
Import ListNotations.
Local Open Scope string_scope.

(* ---- Texts ---- *)
Lemma app_assoc_s (a b c : string) : (a ++ b) ++ c = a ++ (b ++ c).
Proof. induction a; cbn; congruence. Qed.
Lemma app_nil_s (a : string) : a ++ "" = a.
Proof. induction a; cbn; congruence. Qed.
Lemma app_length_s (a b : string) :
  String.length (a ++ b) = (String.length a + String.length b)%nat.
Proof. induction a; cbn; congruence. Qed.
Lemma every_app test a b : every test (a ++ b) = every test a && every test b.
Proof. induction a; cbn; [reflexivity|]. rewrite IHa. apply andb_assoc. Qed.

Fixpoint drop (n : nat) (s : string) : string :=
  match n, s with O, _ => s | S n', String _ s' => drop n' s' | S _, "" => "" end.
Lemma get_drop s : forall n, get n s = match drop n s with "" => None | String c _ => Some c end.
Proof. induction s; intros [|n]; cbn; auto. Qed.
Lemma drop_length s : forall n, String.length (drop n s) = String.length s - n.
Proof. induction s; intros [|n]; cbn; auto. Qed.
Lemma drop_S s : forall n, drop (S n) s = match drop n s with "" => "" | String _ t => t end.
Proof. induction s; intros [|n]; cbn; auto. rewrite <- IHs. reflexivity. Qed.
Lemma substring_drop s : forall n m, n + m <= String.length s ->
  drop n s = substring n m s ++ drop (n + m) s.
Proof.
  induction s; intros [|n] [|m]; cbn; intro L; try lia; auto.
  - f_equal. apply (IHs 0). lia.
  - apply IHs. lia.
  - apply IHs. lia.
Qed.
Lemma substring_length s : forall n m, n + m <= String.length s ->
  String.length (substring n m s) = m.
Proof.
  induction s; intros [|n] [|m]; cbn; intro L; try lia; auto.
  - f_equal. apply (IHs 0). lia.
  - apply IHs. lia.
  - apply IHs. lia.
Qed.

(* Head of what is left: no such character. *)
Definition stops (test : ascii -> bool) (r : string) : Prop :=
  forall c t, r = String c t -> test c = false.

Section Of.
Variable s : string.
Definition rest (left : nat) : string := drop (String.length s - left) s.
Notation N := (String.length s).

Lemma rest_length l : l <= N -> String.length (rest l) = l.
Proof. intro. unfold rest. rewrite drop_length. lia. Qed.
Lemma rest_all : rest N = s.
Proof. unfold rest. rewrite Nat.sub_diag. reflexivity. Qed.
Lemma rest_0 : rest 0 = "".
Proof.
  assert (L : String.length (rest 0) = 0) by (apply rest_length; lia).
  destruct (rest 0); [reflexivity|discriminate].
Qed.
Lemma rest_S l : S l <= N -> rest (S l) = String (here s (S l)) (rest l).
Proof.
  intro L. unfold here, rest. rewrite get_drop.
  replace (N - l) with (S (N - S l)) by lia. rewrite drop_S.
  destruct (drop (N - S l) s) eqn:E; [|reflexivity].
  apply (f_equal String.length) in E. rewrite drop_length in E. cbn in E. lia.
Qed.
Lemma here_0 : here s 0 = "000"%char.
Proof.
  unfold here. rewrite get_drop. fold (rest 0). rewrite rest_0. reflexivity.
Qed.
Lemma uncons l c r : l <= N -> rest l = String c r ->
  exists l', l = S l' /\ here s l = c /\ r = rest l' /\ l' = String.length r.
Proof.
  intros L E. destruct l as [|l]; [rewrite rest_0 in E; discriminate|].
  rewrite rest_S in E by exact L. injection E as <- <-. exists l. rewrite rest_length by lia. auto.
Qed.
(* What is left after t. *)
Lemma unapp t : forall l r, l <= N -> rest l = t ++ r ->
  r = rest (String.length r) /\ l = String.length t + String.length r.
Proof.
  induction t as [|c t IH]; intros l r L E.
  - change ("" ++ r) with r in E. rewrite <- E, rest_length by exact L. auto.
  - change (String c t ++ r) with (String c (t ++ r)) in E.
    destruct (uncons l c _ L E) as (l' & -> & _ & E' & _).
    destruct (IH l' r) as (A & B); [lia|congruence|]. cbn. split; [exact A|lia].
Qed.
Lemma slice_rest l u : u <= l -> l <= N -> rest l = slice s l u ++ rest u.
Proof.
  intros U L. unfold slice, rest at 1. rewrite (substring_drop s (N - l) (l - u)) by lia.
  f_equal. unfold rest. f_equal. lia.
Qed.
Lemma slice_length l u : u <= l -> l <= N -> String.length (slice s l u) = l - u.
Proof. intros U L. apply substring_length. lia. Qed.
Lemma app_inj_l (a b x y : string) : String.length a = String.length b -> a ++ x = b ++ y ->
  a = b /\ x = y.
Proof.
  revert b. induction a; intros [|c b] L E; cbn in *; try discriminate; auto.
  injection E as -> E. destruct (IHa b) as (-> & ->); auto.
Qed.
Lemma slice_is t l r : l <= N -> rest l = t ++ r -> slice s l (String.length r) = t.
Proof.
  intros L E. destruct (unapp t l r L E) as (A & B).
  assert (U : String.length r <= l) by lia. pose proof (slice_rest l _ U L) as S.
  rewrite <- A, E in S. apply app_inj_l in S as (<- & _); [reflexivity|].
  rewrite slice_length by lia. lia.
Qed.

Lemma skip_is test : forall l, l <= N -> exists t,
  rest l = t ++ rest (skip test s l) /\ every test t = true /\ skip test s l <= l /\
  slice s l (skip test s l) = t /\
  (skip test s l <> 0 -> test (here s (skip test s l)) = false).
Proof.
  enough (H : forall l, l <= N -> exists t,
    rest l = t ++ rest (skip test s l) /\ every test t = true /\ skip test s l <= l /\
    (skip test s l <> 0 -> test (here s (skip test s l)) = false)).
  { intros l L. destruct (H l L) as (t & A & B & C & D). exists t. repeat split; auto.
    pose proof (slice_is t l _ L A) as X. rewrite rest_length in X by lia. exact X. }
  induction l as [|l IH]; intro L.
  - exists "". cbn. rewrite rest_0. repeat split; auto. lia.
  - cbn [skip]. destruct (test (here s (S l))) eqn:T.
    + destruct IH as (t & A & B & C & D); [lia|]. exists (String (here s (S l)) t).
      rewrite rest_S by exact L. cbn. rewrite <- A, T, B. repeat split; auto.
    + exists "". cbn. repeat split; auto.
Qed.
Lemma skip_all test t : forall l r, l <= N -> rest l = t ++ r -> every test t = true ->
  stops test r -> skip test s l = String.length r.
Proof.
  induction t as [|c t IH]; intros l r L E V Z.
  - change ("" ++ r) with r in E. subst r. rewrite rest_length by exact L.
    destruct l as [|l]; [reflexivity|]. rewrite rest_S in Z by exact L. cbn.
    rewrite (Z _ _ eq_refl). reflexivity.
  - change (String c t ++ r) with (String c (t ++ r)) in E.
    destruct (uncons l c _ L E) as (l' & -> & H & E' & _). cbn in V. apply andb_prop in V as (V &
      W).
    cbn [skip]. rewrite H, V. apply IH; auto; lia || congruence.
Qed.

(* ---- Whole numbers ---- *)
Lemma digit_is c : digit c = true -> forall d, digit d = false -> (c =? d)%char = false.
Proof. intros D d F. apply Ascii.eqb_neq. intros ->. congruence. Qed.
(* What may follow a value. *)
Definition ending (c : ascii) : bool :=
  blank c || (c =? ",")%char || (c =? "]")%char || (c =? "}")%char.
Definition follows (r : string) : Prop := forall c t, r = String c t -> ending c = true.
Lemma ending_is c : ending c = true ->
  digit c = false /\ ((c =? ".") || (c =? "e") || (c =? "E"))%char = false.
Proof. destruct c as [[] [] [] [] [] [] [] []]; vm_compute; auto; discriminate. Qed.
Lemma follows_stops r : follows r -> stops digit r.
Proof. intros F c t E. apply ending_is, (F c t E). Qed.
Lemma here_rest l r : l <= N -> rest l = r ->
  here s l = match r with "" => "000"%char | String c _ => c end.
Proof.
  intros L <-. destruct l as [|l]; [rewrite rest_0; apply here_0|].
  rewrite rest_S by exact L. reflexivity.
Qed.

Lemma whole_sound l v l' : read_whole s l = Read v l' -> l <= N ->
  l' <= l /\ exists t d, rest l = t ++ rest l' /\ whole t d /\ v = Int d.
Proof.
  unfold read_whole. set (first := if (here s l =? "-")%char then pred l else l). intros E L.
  assert (F : first <= l) by (unfold first; destruct (_ =? _)%char; lia).
  destruct (skip_is digit first) as (t & A & B & C & D & Z); [lia|].
  set (u := skip digit s first) in *.
  destruct (first =? u)%nat eqn:E1; [discriminate|]. apply Nat.eqb_neq in E1.
  destruct ((here s first =? "0")%char && (S u <? first)%nat) eqn:E2; [discriminate|].
  destruct (_ || _ || _); [discriminate|].
  destruct (max_digits <? _)%N eqn:E3; [discriminate|]. apply N.ltb_ge in E3.
  assert (T : String.length t = first - u) by (rewrite <- D; apply slice_length; lia).
  assert (U : unsigned t).
  { split; [intros ->; cbn in T; lia|]. split; [exact B|]. split.
    - intros t' ->. rewrite (here_rest first _ ltac:(lia) A) in E2.
      cbn [append] in E2. rewrite Ascii.eqb_refl, andb_true_l in E2. apply Nat.ltb_ge in E2. cbn in
        T. destruct t'; [reflexivity|cbn in T; lia].
    - unfold size. rewrite T. exact E3. }
  injection E as <- <-. split; [lia|].
  assert (S : exists w, slice s l u = w ++ t /\ rest l = (w ++ t) ++ rest u /\ (w = "" \/ w = "-")).
  { unfold first in *. destruct (here s l =? "-")%char eqn:M.
    - apply Ascii.eqb_eq in M. destruct l as [|l]; [cbn in *; lia|].
      exists "-". assert (R : rest (S l) = ("-" ++ t) ++ rest u).
      { rewrite rest_S, M by exact L. cbn. f_equal. exact A. }
      repeat split; auto. pose proof (slice_is ("-" ++ t) (S l) (rest u) L R) as X.
      rewrite rest_length in X by lia. exact X.
    - exists "". repeat split; auto. }
  destruct S as (w & S & R & W). exists (w ++ t). rewrite S. eexists. split; [exact R|].
  split; [|reflexivity]. destruct W as [-> | ->].
  - change ("" ++ t) with t. destruct (t =? "-0") eqn:M; [|apply not_negative, U].
    apply String.eqb_eq in M. rewrite M in B. discriminate B.
  - destruct ("-" ++ t =? "-0") eqn:M.
    + apply String.eqb_eq in M. rewrite M. apply minus_zero.
    + apply negative; [exact U|]. intros ->. discriminate.
Qed.

Lemma whole_complete t d l r : whole t d -> l <= N -> rest l = t ++ r -> follows r ->
  read_whole s l = Read (Int d) (String.length r).
Proof.
  intros W L E F.
  assert (K : exists w u, t = w ++ u /\ unsigned u /\
    ((w = "" /\ d = t) \/ (w = "-" /\ (u <> "0" /\ d = t \/ u = "0" /\ d = "0")))).
  { destruct W as [u U | u U NZ | ].
    - exists "", u. split; [reflexivity|]. auto.
    - exists "-", u. split; [reflexivity|]. auto 6.
    - exists "-", "0". split; [reflexivity|]. split; [|auto 6]. unfold unsigned.
      split; [discriminate|]. split; [reflexivity|]. split; [|vm_compute; discriminate].
      intros x [= <-]. reflexivity. }
  destruct K as (w & u & -> & U & K). pose proof U as (U1 & U2 & U3 & U4).
  rewrite app_assoc_s in E. unfold read_whole.
  set (first := if (here s l =? "-")%char then pred l else l).
  assert (A : first <= N /\ first <= l /\ rest first = u ++ r).
  { unfold first. destruct K as [(-> & _) | (-> & _)].
    - change ("" ++ (u ++ r)) with (u ++ r) in E. rewrite (here_rest l _ L E).
      destruct u as [|c u]; [congruence|]. cbn. cbn in U2. apply andb_prop in U2 as (U2 & _).
      rewrite (digit_is c U2) by reflexivity. auto.
    - change ("-" ++ (u ++ r)) with (String "-" (u ++ r)) in E.
      destruct (uncons l _ _ L E) as (l' & -> & -> & E' & _). cbn. repeat split; auto; lia. }
  destruct A as (A1 & A2 & A3). destruct (unapp u first r A1 A3) as (R & B).
  rewrite (skip_all digit u first r A1 A3 U2 (follows_stops r F)).
  assert (LU : String.length u > 0) by (destruct u; [congruence|cbn; lia]).
  replace (first =? String.length r)%nat with false by (symmetry; apply Nat.eqb_neq; lia).
  assert (Z : (here s first =? "0")%char && (S (String.length r) <? first)%nat = false).
  { rewrite (here_rest first _ A1 A3). destruct u as [|c u]; [congruence|].
    cbn [append]. destruct (c =? "0")%char eqn:C; [|reflexivity]. apply Ascii.eqb_eq in C. subst c.
    rewrite (U3 u eq_refl) in B. cbn in B. apply Nat.ltb_ge. lia. }
  rewrite Z, (here_rest (String.length r) r) by (congruence || lia).
  replace (match r with "" => _ | String _ _ => _ end) with
    (match r with "" => "000"%char | String c _ => c end) by reflexivity.
  assert (Y : let c := match r with "" => "000"%char | String c _ => c end in
    ((c =? ".") || (c =? "e") || (c =? "E"))%char = false).
  { destruct r as [|c r]; [reflexivity|]. apply (ending_is c), (F c r eq_refl). }
  cbv zeta in *. rewrite Y. replace (first - String.length r) with (String.length u) by lia.
  replace (max_digits <? N.of_nat (String.length u))%N with false
    by (symmetry; apply N.ltb_ge; exact U4).
  rewrite (slice_is (w ++ u) l r L) by (rewrite app_assoc_s; exact E).
  do 2 f_equal. destruct K as [(-> & ->) | (-> & [(NZ & ->) | (-> & ->)])]; [| |reflexivity].
  - destruct u as [|c u]; [congruence|]. cbn in U2. apply andb_prop in U2 as (U2 & _).
    cbn [append String.eqb]. rewrite (digit_is c U2) by reflexivity. reflexivity.
  - destruct (String.eqb_spec ("-" ++ u) "-0") as [X|X]; [|reflexivity].
    injection X as ->. congruence.
Qed.

(* ---- Texts between quotes ---- *)
Lemma concat_cons p l : String.concat "" (p :: l) = p ++ String.concat "" l.
Proof. destruct l; cbn; [symmetry; apply app_nil_s|reflexivity]. Qed.
Lemma concat_app a b : String.concat "" (a ++ b)%list = String.concat "" a ++ String.concat "" b.
Proof.
  induction a as [|x a IH]; [reflexivity|]. change ((x :: a) ++ b)%list with (x :: (a ++ b))%list.
  rewrite !concat_cons, IH, app_assoc_s. reflexivity.
Qed.
Lemma glued_is l : glued l = String.concat "" (rev l).
Proof.
  destruct l as [|p [|q l]]; [reflexivity|reflexivity|]. unfold glued.
  rewrite rev_append_rev, app_nil_r. reflexivity.
Qed.
Lemma glued_cons p l : glued (p :: l) = glued l ++ p.
Proof. rewrite !glued_is. cbn [rev]. rewrite concat_app. reflexivity. Qed.

Lemma spells_plain p : forall t y, every plain p = true -> spells t y -> spells (p ++ t) (p ++ y).
Proof.
  induction p as [|c p IH]; intros t y E H; [exact H|]. cbn in *. apply andb_prop in E as (E & F).
  apply itself; auto.
Qed.

Lemma four_quote a b c d : a = quote \/ b = quote \/ c = quote \/ d = quote -> four a b c d = None.
Proof.
  unfold four. assert (Q : hex quote = None) by reflexivity.
  intros [-> | [-> | [-> | ->]]]; rewrite Q;
    repeat (try reflexivity; match goal with |- context [hex ?x] => destruct (hex x) end);
    reflexivity.
Qed.
Lemma second_before t r : second_half (t ++ String quote r) = second_half t.
Proof.
  assert (Z : forall x u a b c d,
    a = quote \/ b = quote \/ c = quote \/ d = quote ->
    (if (x =? "\")%char && (u =? "u")%char then
       match four a b c d with Some n => if low n then Some n else None | None => None end
     else None) = None :> option BinNums.N).
  { intros x u a b c d Q. rewrite (four_quote a b c d Q). destruct (_ && _); reflexivity. }
  destruct t as [|x [|u [|a [|b [|c [|d t]]]]]]; cbn [append second_half]; try reflexivity;
    destruct r as [|e r]; try reflexivity; try (apply Z; tauto);
    destruct r as [|f r]; try reflexivity; try (apply Z; tauto);
    destruct r as [|g r]; try reflexivity; try (apply Z; tauto);
    destruct r as [|h r]; try reflexivity; try (apply Z; tauto);
    try (destruct r; reflexivity).
  all: change (quote =? "u")%char with false; rewrite andb_false_r; reflexivity.
Qed.

Lemma four_at_is l a b c d r : l <= N -> rest l = String a (String b (String c (String d r))) ->
  four_at s l = four a b c d /\ r = rest (l - 4) /\ 4 <= l.
Proof.
  intros L E. apply uncons in E as (l1 & -> & A & E & _); [|exact L]. symmetry in E.
  apply uncons in E as (l2 & -> & B & E & _); [|lia]. symmetry in E.
  apply uncons in E as (l3 & -> & C & E & _); [|lia]. symmetry in E.
  apply uncons in E as (l4 & -> & D & E & _); [|lia].
  unfold four_at. replace (S (S (S (S l4))) - 1) with (S (S (S l4))) by lia.
  replace (S (S (S (S l4))) - 2) with (S (S l4)) by lia.
  replace (S (S (S (S l4))) - 3) with (S l4) by lia. rewrite A, B, C, D.
  replace (S (S (S (S l4))) - 4) with l4 by lia. repeat split; auto. lia.
Qed.
Lemma four_at_rest l n : l <= N -> four_at s l = Some n -> exists a b c d,
  rest l = String a (String b (String c (String d (rest (l - 4))))) /\ four a b c d = Some n.
Proof.
  intros L E. destruct l as [|[|[|[|l]]]]; try discriminate.
  exists (here s (S (S (S (S l))))), (here s (S (S (S l)))), (here s (S (S l))), (here s (S l)).
  assert (R : rest (S (S (S (S l)))) = String (here s (S (S (S (S l))))) (String (here s (S (S (S
    l))))
    (String (here s (S (S l))) (String (here s (S l)) (rest l))))).
  { rewrite !rest_S by lia. reflexivity. }
  replace (S (S (S (S l))) - 4) with l by lia. split; [exact R|].
  rewrite <- E. symmetry. apply (four_at_is _ _ _ _ _ _ L R).
Qed.
Lemma second_at_is l : l <= N -> second_at s l = second_half (rest l).
Proof.
  intro L. unfold second_at. rewrite (here_rest l _ L eq_refl).
  destruct (rest l) as [|x r] eqn:E; [reflexivity|].
  apply uncons in E as (l1 & -> & _ & E & _); [|exact L].
  replace (S l1 - 1) with l1 by lia. replace (S l1 - 2) with (l1 - 1) by lia.
  rewrite (here_rest l1 r ltac:(lia) (eq_sym E)). subst r.
  destruct (rest l1) as [|u r] eqn:E.
  { rewrite andb_comm. cbn. destruct (x =? "\")%char; reflexivity. }
  apply uncons in E as (l2 & -> & _ & E & _); [|lia]. replace (S l2 - 1) with l2 by lia.
  destruct ((x =? "\")%char && (u =? "u")%char) eqn:G.
  2: { cbn [second_half]. destruct r as [|a [|b [|c [|d r]]]]; auto. rewrite G. reflexivity. }
  assert (F : four_at s l2 = match r with
    String a (String b (String c (String d _))) => four a b c d | _ => None end).
  { destruct (four_at s l2) as [n|] eqn:F.
    - destruct (four_at_rest l2 n) as (a & b & c & d & R & <-); [lia|exact F|]. rewrite E, R.
      reflexivity.
    - destruct r as [|a [|b [|c [|d r]]]]; auto.
      destruct (four_at_is l2 a b c d r) as (X & _); [lia|auto|]. congruence. }
  rewrite F. cbn [second_half]. destruct r as [|a [|b [|c [|d r]]]]; auto. rewrite G. reflexivity.
Qed.

Lemma escape_sound l p l' : l <= N -> read_escape s l = Some (p, l') ->
  l' < l /\ exists e, rest l = e ++ rest l' /\
  forall t y r, rest l' = t ++ String quote r -> spells t y ->
    spells (String "\" (e ++ t)) (p ++ y).
Proof.
  intros L E. destruct l as [|l]; [discriminate|]. cbn [read_escape] in E.
  pose proof (rest_S l L) as R. destruct (here s (S l) =? "u")%char eqn:U.
  - apply Ascii.eqb_eq in U. rewrite U in R. destruct (four_at s l) as [n|] eqn:F; [|discriminate].
    destruct (four_at_rest l n) as (a & b & c & d & R1 & F1); [lia|exact F|].
    destruct (four_at_is l a b c d _ ltac:(lia) R1) as (_ & _ & L4).
    rewrite (second_at_is (l - 4)) in E by lia.
    destruct (if high n then _ else _) as [m|] eqn:M.
    + injection E as <- <-. destruct (high n) eqn:H; [|discriminate].
      destruct (rest (l - 4)) as [|x [|u [|e [|f [|g [|h r']]]]]] eqn:R2; try discriminate.
      cbn [second_half] in M. destruct (_ && _) eqn:XU; [|discriminate].
      apply andb_prop in XU as (X & UU). apply Ascii.eqb_eq in X, UU. subst x u.
      destruct (four e f g h) as [m'|] eqn:F2; [|discriminate].
      destruct (low m') eqn:LO; [|discriminate]. injection M as ->.
      destruct (unapp (String "\" (String "u" (String e (String f (String g (String h "")))))) (l -
        4) r')
        as (R3 & LL); [lia|exact R2|]. cbn in LL.
      replace (l - 10) with (String.length r') by lia. split; [lia|].
      exists (String "u" (String a (String b (String c (String d (String "\" (String "u"
        (String e (String f (String g (String h "")))))))))))%char.
      rewrite R, R1. cbn. rewrite <- R3. split; [reflexivity|]. intros t y r Et Sp.
      eapply paired; eauto.
    + injection E as <- <-. split; [lia|].
      exists (String "u" (String a (String b (String c (String d "")))))%char.
      rewrite R, R1. split; [reflexivity|]. intros t y r Et Sp. apply numbered; auto.
      intro H. rewrite H in M. rewrite Et, second_before in M. exact M.
  - destruct (escaped (here s (S l))) as [d|] eqn:D; [|discriminate]. injection E as <- <-.
    split; [lia|]. exists (String (here s (S l)) ""). split; [exact R|]. intros t y r _ Sp.
    cbn. eapply short; eauto.
Qed.

Lemma text_sound fuel : forall l ps x l', l <= N -> read_text fuel s l ps = Read x l' ->
  l' < l /\ exists t y, rest l = t ++ String quote (rest l') /\ spells t y /\ x = glued ps ++ y.
Proof.
  induction fuel as [|fuel IH]; intros l ps x l' L E; [discriminate|]. cbn [read_text] in E.
  destruct (skip_is plain l L) as (p & A & B & C & D & Z). set (u := skip plain s l) in *.
  assert (G : glued (if (l =? u)%nat then ps else slice s l u :: ps) = glued ps ++ p).
  { destruct (Nat.eqb_spec l u) as [X|X].
    - rewrite <- X in D. pose proof (slice_length l l) as K. rewrite D in K.
      destruct p; [symmetry; apply app_nil_s|cbn in K; lia].
    - rewrite glued_cons, D. reflexivity. }
  set (ps' := if (l =? u)%nat then ps else slice s l u :: ps) in *.
  destruct u as [|next] eqn:U; [discriminate|]. pose proof (rest_S next ltac:(lia)) as R.
  destruct (here s (S next) =? quote)%char eqn:Q.
  - injection E as <- <-. apply Ascii.eqb_eq in Q. rewrite Q in R. split; [lia|].
    exists p, p. rewrite A, R. repeat split; auto. rewrite <- (app_nil_s p) at 1 2.
    apply spells_plain; [exact B|apply nothing].
  - destruct (here s (S next) =? "\")%char eqn:K; [|discriminate]. apply Ascii.eqb_eq in K.
    rewrite K in R. destruct (read_escape s next) as [[piece next']|] eqn:F; [|discriminate].
    destruct (escape_sound next piece next' ltac:(lia) F) as (L1 & e & R1 & Sp).
    destruct (IH next' (piece :: ps') x l' ltac:(lia) E) as (L2 & t & y & R2 & Sy & ->). split;
      [lia|].
    exists (p ++ String "\" (e ++ t)), (p ++ piece ++ y). split; [|split].
    + rewrite A, R, R1, R2, !app_assoc_s. cbn. rewrite app_assoc_s. reflexivity.
    + apply spells_plain; [exact B|]. eapply Sp; eauto.
    + rewrite glued_cons, G, !app_assoc_s. reflexivity.
Qed.

Lemma spells_run t y : spells t y -> exists p t' y', t = p ++ t' /\ y = p ++ y' /\
  every plain p = true /\ spells t' y' /\ (t' = "" \/ exists t'', t' = String "\" t'').
Proof.
  induction 1 as [ |c t y P H (p & t' & y' & -> & -> & E & S & K)| | | ];
    [exists "", "", ""; repeat split; auto; apply nothing
    |exists (String c p), t', y'; cbn; rewrite P; repeat split; auto| | | ];
    eexists "", _, _; repeat split; eauto; [eapply short|apply numbered|eapply paired]; eassumption.
Qed.
Lemma text_complete fuel : forall t y, spells t y -> forall l ps r, l <= N -> l < fuel ->
  rest l = t ++ String quote r ->
  read_text fuel s l ps = Read (glued ps ++ y) (String.length r).
Proof.
  induction fuel as [|fuel IH]; intros t y Sp l ps r L F E; [lia|].
  destruct (spells_run t y Sp) as (p & t' & y' & -> & -> & B & Sp' & K).
  rewrite app_assoc_s in E. cbn [read_text].
  assert (ST : stops plain (t' ++ String quote r)).
  { destruct K as [-> | (t'' & ->)]; intros c x [= <- _]; reflexivity. }
  rewrite (skip_all plain p l _ L E B ST).
  destruct (unapp p l _ L E) as (R & LL). set (u := String.length (t' ++ String quote r)) in *.
  assert (G : glued (if (l =? u)%nat then ps else slice s l u :: ps) = glued ps ++ p).
  { destruct (Nat.eqb_spec l u) as [X|X].
    - destruct p; [symmetry; apply app_nil_s|cbn in LL; lia].
    - rewrite glued_cons. unfold u. rewrite (slice_is p l _ L E). reflexivity. }
  set (ps' := if (l =? u)%nat then ps else slice s l u :: ps) in *.
  destruct K as [-> | (t'' & ->)].
  - inversion Sp'; subst. change ("" ++ String quote r) with (String quote r) in *.
    destruct (uncons u _ _ ltac:(lia) (eq_sym R)) as (n & -> & H & _ & ->). rewrite H, G, app_nil_s.
    reflexivity.
  - change (String "\" t'' ++ String quote r) with (String "\" (t'' ++ String quote r)) in R.
    destruct (uncons u _ _ ltac:(lia) (eq_sym R)) as (n & U & H & R' & _). rewrite U.
    rewrite U in H, LL. rewrite H. cbn [Ascii.eqb Bool.eqb quote].
    change ("\" =? quote)%char with false. change ("\" =? "\")%char with true. cbv iota.
    assert (D : exists piece next' t1 y1, read_escape s n = Some (piece, next') /\ next' < n /\
      rest next' = t1 ++ String quote r /\ spells t1 y1 /\ y' = piece ++ y1).
    { inversion Sp' as [ |c0 t0 s0 P0 S0 E0|c0 d0 t0 s0 P0 S0 E0|a b c d m t0 s0 F0 H0 S0 E0
                        |a b c d m e f g h m2 t0 s0 F0 H0 F1 H1 S0 E0].
      - subst. discriminate.
      - subst. change (String c0 t0 ++ String quote r) with (String c0 (t0 ++ String quote r)) in
        R'.
        destruct (uncons n _ _ ltac:(lia) (eq_sym R')) as (n' & -> & H' & R1 & _). cbn
          [read_escape].
        rewrite H'. destruct (c0 =? "u")%char eqn:X.
        { apply Ascii.eqb_eq in X. rewrite X in P0. discriminate P0. }
        rewrite P0. exists (String d0 ""), n', t0, s0. repeat split; auto.
      - subst. cbn in R'.
        destruct (uncons n _ _ ltac:(lia) (eq_sym R')) as (n' & -> & H' & R1 & _). cbn
          [read_escape].
        rewrite H'. change ("u" =? "u")%char with true. cbv iota.
        destruct (four_at_is n' a b c d _ ltac:(lia) (eq_sym R1)) as (F9 & R2 & L4).
        rewrite F9, F0, (second_at_is (n' - 4)), <- R2, second_before by lia.
        destruct (high m) eqn:HM; [rewrite (H0 eq_refl)|];
          exists (encoded m), (n' - 4), t0, s0; repeat split; auto; lia.
      - subst. cbn in R'.
        destruct (uncons n _ _ ltac:(lia) (eq_sym R')) as (n' & -> & H' & R1 & _). cbn
          [read_escape].
        rewrite H'. change ("u" =? "u")%char with true. cbv iota.
        destruct (four_at_is n' a b c d _ ltac:(lia) (eq_sym R1)) as (F9 & R2 & L4).
        rewrite F9, F0, H0, (second_at_is (n' - 4)), <- R2 by lia. cbn [second_half].
        change (("\" =? "\")%char && ("u" =? "u")%char) with true. cbv iota. rewrite F1, H1.
        exists (encoded (joined m m2)), (n' - 10), t0, s0. repeat split; auto; try lia.
        destruct (unapp (String "\" (String "u" (String e (String f (String g (String h "")))))) (n'
          - 4)
          (t0 ++ String quote r)) as (R3 & L3); [lia|symmetry; exact R2|]. cbn in L3.
        replace (n' - 10) with (String.length (t0 ++ String quote r)) by lia. symmetry. exact R3. }
    destruct D as (piece & next' & t1 & y1 & -> & L1 & R1 & S1 & ->).
    rewrite (IH _ _ S1 next' (piece :: ps') r) by (auto; lia). rewrite glued_cons, G, !app_assoc_s.
    reflexivity.
Qed.

(* ---- No key twice ---- *)
Lemma differ_is l : differ l = true <-> NoDup l.
Proof.
  induction l as [|x l IH]; cbn; [split; [constructor|auto]|].
  rewrite andb_true_iff, negb_true_iff, IH. split.
  - intros (E & D). constructor; [|exact D]. intro I.
    enough (existsb (String.eqb x) l = true) by congruence.
    apply existsb_exists. exists x. split; [exact I|apply String.eqb_refl].
  - intro D. inversion D as [|? ? I D']; subst. split; [|exact D'].
    destruct (existsb (String.eqb x) l) eqn:E; [|reflexivity].
    apply existsb_exists in E as (y & Y & Z). apply String.eqb_eq in Z. congruence.
Qed.
Lemma deal_is test l : forall a b, deal test l a b =
  ((rev (filter test l) ++ a)%list, (rev (filter (fun x => negb (test x)) l) ++ b)%list).
Proof.
  induction l as [|x l IH]; intros a b; cbn; [reflexivity|].
  destruct (test x); rewrite IH; cbn; rewrite <- !app_assoc; reflexivity.
Qed.
Lemma parts_unique (test : string -> bool) l :
  NoDup l <-> NoDup (filter test l) /\ NoDup (filter (fun x => negb (test x)) l).
Proof.
  split; [intro D; split; apply NoDup_filter, D|].
  induction l as [|x l IH]; cbn; [constructor|]. intros (A & B).
  destruct (test x) eqn:T; cbn in B; [inversion A|inversion B]; subst;
    (constructor; [|apply IH; auto]); intro I;
    match goal with H : ~ In x _ |- _ => apply H end; apply filter_In; rewrite ?T; auto.
Qed.
Lemma rev_unique (l : list string) : NoDup (rev l) <-> NoDup l.
Proof.
  split; intro H.
  - rewrite <- (rev_involutive l). apply NoDup_rev, H.
  - apply NoDup_rev, H.
Qed.
Lemma unique_is level : forall l, unique level l = true <-> NoDup l.
Proof.
  induction level as [|level IH]; intro l; cbn [unique]; [apply differ_is|].
  destruct (few 8 l); [apply differ_is|]. rewrite deal_is, !app_nil_r, andb_true_iff, !IH.
  rewrite !rev_unique. symmetry. apply parts_unique.
Qed.
Lemma names_are (l : list (string * json)) : forall k,
  NoDup (fold_left (fun names m => fst m :: names) l k) <-> NoDup (map fst (rev_append l []) ++ k).
Proof.
  intro k. rewrite rev_append_rev, app_nil_r, map_rev.
  assert (E : fold_left (fun names m => fst m :: names) l k = (rev (map fst l) ++ k)%list).
  { revert k. induction l as [|m l IH]; intro k; cbn; [reflexivity|].
    rewrite IH, <- app_assoc. reflexivity. }
  rewrite E. reflexivity.
Qed.
Lemma names_unique l (k : string) (v : json) : NoDup (fold_left (fun names m => fst m :: names) l
  [k]) <->
  NoDup (map fst (rev_append l [(k, v)])).
Proof.
  rewrite names_are, !rev_append_rev, app_nil_r, map_app. reflexivity.
Qed.

(* ---- Values ---- *)
Lemma blank_is c : blank c = true ->
  plain c = true \/ within "000" "031" c = true.
Proof. destruct c as [[] [] [] [] [] [] [] []]; vm_compute; auto. Qed.
(* What a value begins with. *)
Definition first_of (c : ascii) : Prop := blank c = false /\ (c =? "]")%char = false.
Lemma digit_first c : digit c = true -> first_of c.
Proof. destruct c as [[] [] [] [] [] [] [] []]; vm_compute; intuition discriminate. Qed.
Lemma value_first n t v : value n t v -> exists c t', t = String c t' /\ first_of c.
Proof.
  assert (U : forall s, unsigned s -> exists c t', s = String c t' /\ first_of c).
  { intros u (A & B & _). destruct u as [|c u]; [congruence|]. exists c, u. split; [reflexivity|].
    apply digit_first. cbn in B. apply andb_prop in B. tauto. }
  intros V. destruct V as [n|n|n|n t d W|n t d W|n b B|n t l B|n b B|n t l B];
    try (eexists _, _; split; [reflexivity|split; reflexivity]).
  destruct W as [u W|u W _|]; [apply U, W| |]; eexists _, _; split; try reflexivity; split;
    reflexivity.
Qed.
Lemma blank_stops c t : blank c = false -> stops blank (String c t).
Proof. intros B d u [= <- _]. exact B. Qed.
Lemma skip_blank b : forall l c r, l <= N -> rest l = b ++ String c r -> every blank b = true ->
  blank c = false -> exists l', skip blank s l = S l' /\ here s (S l') = c /\ rest l' = r /\ S l' <=
    l.
Proof.
  intros l c r L E B C. destruct (unapp b l _ L E) as (R & K).
  rewrite (skip_all blank b l _ L E B (blank_stops c r C)).
  destruct (uncons (String.length (String c r)) c r ltac:(lia) (eq_sym R)) as (l' & E' & H & R' &
    _).
  exists l'.
  rewrite E' in *. repeat split; auto. lia.
Qed.

(* What a reader of values has to find. *)
Definition sound (n : nat) (inner : nat -> outcome json) : Prop := forall l v l',
  inner l = Read v l' -> l <= N ->
  l' <= l /\ exists b t, every blank b = true /\ rest l = b ++ t ++ rest l' /\ value n t v.

Lemma spaced_sound n inner l v l' : sound n inner -> inner l = Read v l' -> l <= N ->
  skip blank s l' <= l /\ exists t, rest l = t ++ rest (skip blank s l') /\ spaced n t v.
Proof.
  intros S E L. destruct (S l v l' E L) as (K & b & t & B & R & V).
  destruct (skip_is blank l') as (w & A & W & C & _); [lia|]. split; [lia|].
  exists (b ++ t ++ w). rewrite R, A, !app_assoc_s. split; [reflexivity|].
  apply between_blanks; auto.
Qed.
Lemma elements_sound n inner : sound n inner -> forall fuel l done v l',
  read_elements inner s fuel l done = Read v l' -> l <= N ->
  l' < l /\ exists t w, rest l = t ++ String "]" (rest l') /\ elements n t w /\
    v = rev_append done w.
Proof.
  intro S. induction fuel as [|fuel IH]; intros l done v l' E L; [discriminate|].
  cbn [read_elements] in E. destruct (inner l) as [x after|] eqn:I; [|discriminate].
  destruct (spaced_sound n inner l x after S I L) as (K & t & R & V).
  set (next := skip blank s after) in *.
  destruct (here s next =? ",")%char eqn:C.
  - apply Ascii.eqb_eq in C. destruct next as [|m]; [rewrite here_0 in C; discriminate|].
    rewrite rest_S, C in R by lia. cbn [pred] in E.
    destruct (IH m _ v l' E) as (K2 & u & w & R2 & V2 & ->); [lia|]. split; [lia|].
    exists (t ++ "," ++ u), (x :: w). split; [|split; [apply more; auto|reflexivity]].
    rewrite R, R2, !app_assoc_s. reflexivity.
  - destruct (here s next =? "]")%char eqn:D; [|discriminate]. injection E as <- <-.
    apply Ascii.eqb_eq in D. destruct next as [|m]; [rewrite here_0 in D; discriminate|].
    rewrite rest_S, D in R by lia. cbn [pred]. split; [lia|]. exists t, [x].
    split; [exact R|]. split; [apply one, V|reflexivity].
Qed.
Lemma members_sound n inner : sound n inner -> forall fuel l done v l',
  read_members inner s fuel l done = Read v l' -> l <= N ->
  l' < l /\ NoDup (map fst v) /\ exists t w, rest l = t ++ String "}" (rest l') /\ members n t w /\
    v = rev_append done w.
Proof.
  intro S. induction fuel as [|fuel IH]; intros l done v l' E L; [discriminate|].
  cbn [read_members] in E.
  destruct (skip_is blank l L) as (a & A & BA & LA & _). set (first := skip blank s l) in *.
  destruct (here s first =? quote)%char eqn:Q; [|discriminate]. apply Ascii.eqb_eq in Q.
  cbn [negb] in E. destruct first as [|f]; [rewrite here_0 in Q; discriminate|].
  rewrite rest_S, Q in A by lia. cbn [pred] in E.
  destruct (read_text (Datatypes.S f) s f []) as [key after|] eqn:T; [|discriminate].
  destruct (text_sound _ f [] key after ltac:(lia) T) as (LT & k & y & RK & SK & EY).
  change (glued [] ++ y) with y in EY. subst y.
  destruct (skip_is blank after) as (b & B & BB & LB & _); [lia|].
  set (colon := skip blank s after) in *.
  destruct (here s colon =? ":")%char eqn:C; [|discriminate]. apply Ascii.eqb_eq in C.
  cbn [negb] in E. destruct colon as [|c]; [rewrite here_0 in C; discriminate|].
  rewrite rest_S, C in B by lia. cbn [pred] in E.
  destruct (inner c) as [x after'|] eqn:I; [|discriminate].
  destruct (spaced_sound n inner c x after' S I) as (K & t & R & V); [lia|].
  set (next := skip blank s after') in *.
  assert (W : rest l = a ++ quoted k ++ b ++ ":" ++ t ++ rest next).
  { rewrite A, RK, B, R. unfold quoted. cbn. rewrite !app_assoc_s. reflexivity. }
  destruct (here s next =? ",")%char eqn:D.
  - apply Ascii.eqb_eq in D. destruct next as [|m]; [rewrite here_0 in D; discriminate|].
    rewrite rest_S, D in W by lia. cbn [pred] in E.
    destruct (IH m _ v l' E) as (K2 & ND & u & w & R2 & V2 & ->); [lia|]. split; [lia|].
    split; [exact ND|].
    exists (a ++ quoted k ++ b ++ ":" ++ t ++ "," ++ u), ((key, x) :: w).
    split; [|split; [apply pairs; auto|reflexivity]].
    rewrite W, R2. repeat (rewrite ?app_assoc_s; cbn [append]). reflexivity.
  - destruct (here s next =? "}")%char eqn:G; [|discriminate].
    destruct (unique 24 _) eqn:UN; [|discriminate]. injection E as <- <-.
    apply unique_is, names_unique with (v := x) in UN.
    apply Ascii.eqb_eq in G. destruct next as [|m]; [rewrite here_0 in G; discriminate|].
    rewrite rest_S, G in W by lia. cbn [pred]. split; [lia|]. split; [exact UN|].
    exists (a ++ quoted k ++ b ++ ":" ++ t), [(key, x)].
    split; [|split; [apply pair_; auto|reflexivity]].
    rewrite W. repeat (rewrite ?app_assoc_s; cbn [append]). reflexivity.
Qed.

Lemma word_sound w v l x l' : read_word w v s l = Read x l' -> l <= N ->
  l' <= l /\ rest l = w ++ rest l' /\ x = v.
Proof.
  unfold read_word. intros E L. destruct (slice _ _ _ =? w) eqn:Q; [|discriminate].
  injection E as <- <-. apply String.eqb_eq in Q. split; [lia|]. split; [|reflexivity].
  rewrite <- Q at 1. apply slice_rest; lia.
Qed.
Lemma read_value_is n l : read_value n s l =
  let left := skip blank s l in
  let c := here s left in
  if (c =? quote)%char then as_json Str (read_text left s (pred left) []) else
  if (c =? "[")%char then
    let next := skip blank s (pred left) in
    if (here s next =? "]")%char then Read (Arr []) (pred next) else
    match n with
    | O => Wrong "too deep a nesting" next
    | S m => as_json Arr (read_elements (read_value m s) s left (pred left) [])
    end
  else if (c =? "{")%char then
    let next := skip blank s (pred left) in
    if (here s next =? "}")%char then Read (Obj []) (pred next) else
    match n with
    | O => Wrong "too deep a nesting" next
    | S m => as_json Obj (read_members (read_value m s) s left (pred left) [])
    end
  else if (c =? "t")%char then read_word "true" (Bool true) s left
  else if (c =? "f")%char then read_word "false" (Bool false) s left
  else if (c =? "n")%char then read_word "null" Null s left
  else read_whole s left.
Proof. destruct n; reflexivity. Qed.

Lemma here_S i c : i <= N -> c <> "000"%char -> (here s i =? c)%char = true ->
  exists j, i = S j /\ rest i = String c (rest j).
Proof.
  intros L C E. apply Ascii.eqb_eq in E. destruct i as [|j]; [rewrite here_0 in E; congruence|].
  exists j. split; [reflexivity|]. rewrite rest_S, E by exact L. reflexivity.
Qed.
Lemma value_sound n : sound n (read_value n s).
Proof.
  induction n as [n IH] using lt_wf_ind. intros l v l' E L. rewrite read_value_is in E. cbv zeta in
    E.
  destruct (skip_is blank l L) as (a & A & BA & LA & _). set (i := skip blank s l) in *.
  enough (G : l' <= i /\ exists t, rest i = t ++ rest l' /\ value n t v).
  { destruct G as (K & t & R & V). split; [lia|]. exists a, t. rewrite A, R. auto. }
  assert (LI : i <= N) by lia. clear A BA.
  destruct (here s i =? quote)%char eqn:C1; [|destruct (here s i =? "[")%char eqn:C2;
    [|destruct (here s i =? "{")%char eqn:C3]].
  - destruct (here_S i quote LI ltac:(discriminate) C1) as (j & EI & R). rewrite EI in E, LI |- *.
    cbn [pred] in E. destruct (read_text (S j) s j []) as [x after|] eqn:T; [|discriminate].
    injection E as <- <-. destruct (text_sound _ j [] x after ltac:(lia) T) as (LT & k & y & RK & SK
      & EY).
    change (glued [] ++ y) with y in EY. subst y. split; [lia|]. exists (quoted k).
    split; [rewrite <- EI, R, RK; unfold quoted; cbn; rewrite app_assoc_s; reflexivity|].
    constructor. exact SK.
  - destruct (here_S i "[" LI ltac:(discriminate) C2) as (j & EI & R). rewrite EI in E, LI |- *.
    cbn [pred] in E. destruct (skip_is blank j ltac:(lia)) as (b & B & BB & LB & _).
    set (next := skip blank s j) in *. destruct (here s next =? "]")%char eqn:C.
    + injection E as <- <-. destruct (here_S next "]" ltac:(lia) ltac:(discriminate) C) as (m & EM &
      RM).
      rewrite EM. cbn [pred]. split; [lia|]. exists ("[" ++ b ++ "]").
      split; [rewrite <- EI, R, B, RM; cbn; rewrite app_assoc_s; reflexivity|constructor; exact BB].
    + destruct n as [|m]; [discriminate|].
      destruct (read_elements _ s (S j) j []) as [w after|] eqn:T; [|discriminate].
      injection E as <- <-.
      destruct (elements_sound m _ (IH m ltac:(lia)) (S j) j [] w after T ltac:(lia)) as
        (LT & t & w' & RT & VT & ->). split; [lia|]. exists ("[" ++ t ++ "]").
      split; [rewrite <- EI, R, RT; cbn; rewrite !app_assoc_s; reflexivity|].
      change (rev_append [] w') with w'. constructor. exact VT.
  - destruct (here_S i "{" LI ltac:(discriminate) C3) as (j & EI & R). rewrite EI in E, LI |- *.
    cbn [pred] in E. destruct (skip_is blank j ltac:(lia)) as (b & B & BB & LB & _).
    set (next := skip blank s j) in *. destruct (here s next =? "}")%char eqn:C.
    + injection E as <- <-. destruct (here_S next "}" ltac:(lia) ltac:(discriminate) C) as (m & EM &
      RM).
      rewrite EM. cbn [pred]. split; [lia|]. exists ("{" ++ b ++ "}").
      split; [rewrite <- EI, R, B, RM; cbn; rewrite app_assoc_s; reflexivity|constructor; exact BB].
    + destruct n as [|m]; [discriminate|].
      destruct (read_members _ s (S j) j []) as [w after|] eqn:T; [|discriminate].
      injection E as <- <-.
      destruct (members_sound m _ (IH m ltac:(lia)) (S j) j [] w after T ltac:(lia)) as
        (LT & ND & t & w' & RT & VT & ->). split; [lia|]. exists ("{" ++ t ++ "}").
      split; [rewrite <- EI, R, RT; cbn; rewrite !app_assoc_s; reflexivity|].
      change (rev_append [] w') with w' in *. constructor; [exact VT|exact ND].
  - repeat match type of E with (if ?c then _ else _) = _ => destruct c end;
      try (apply word_sound in E as (K & R & ->); [|exact LI]; split; [exact K|]; eexists;
           split; [exact R|constructor]).
    destruct (whole_sound i v l' E LI) as (K & t & d & R & W & ->). split; [exact K|]. exists t.
    split; [exact R|]. constructor. exact W.
Qed.

Scheme value_ind2 := Minimality for value Sort Prop
  with spaced_ind2 := Minimality for spaced Sort Prop
  with elements_ind2 := Minimality for elements Sort Prop
  with members_ind2 := Minimality for members Sort Prop.
Combined Scheme all_ind from value_ind2, spaced_ind2, elements_ind2, members_ind2.

(* What may follow a value and blanks. *)
Definition closes (r : string) : Prop := stops blank r /\ follows r.
Lemma follows_blank b r : every blank b = true -> follows r -> follows (b ++ r).
Proof.
  intros B F. destruct b as [|c b]; [exact F|]. intros d t [= <- _]. cbn in B.
  apply andb_prop in B as (B & _). unfold ending. rewrite B. reflexivity.
Qed.
Lemma closes_with c r : blank c = false -> ending c = true -> closes (String c r).
Proof. intros B E. split; intros d t [= <- _]; assumption. Qed.
Lemma elements_first n t l : elements n t l ->
  exists b c u, t = b ++ String c u /\ every blank b = true /\ first_of c.
Proof.
  assert (S : forall t v, spaced n t v -> exists b c u, t = b ++ String c u /\ every blank b = true
    /\
    first_of c).
  { intros u v V. destruct V as [n a u w v A W V]. destruct (value_first n u v V) as (c & x & -> &
    F).
    exists a, c, (x ++ w). auto. }
  intros V. destruct V as [n t v V|n t v u l V _]; destruct (S t v V) as (b & c & x & -> & B & F).
  - exists b, c, x. auto.
  - exists b, c, (x ++ "," ++ u). rewrite app_assoc_s. auto.
Qed.
Lemma members_first n t l : members n t l ->
  exists b u, t = b ++ String quote u /\ every blank b = true.
Proof.
  intros V. destruct V; eexists _, _; (split; [unfold quoted; cbn; reflexivity|assumption]).
Qed.
Lemma word_complete w v l r : l <= N -> rest l = w ++ r ->
  read_word w v s l = Read v (String.length r).
Proof.
  intros L E. destruct (unapp w l r L E) as (_ & K). unfold read_word.
  replace (l - String.length w) with (String.length r) by lia.
  rewrite (slice_is w l r L E), String.eqb_refl. reflexivity.
Qed.
Lemma uncons_app t c r l : l <= N -> rest l = t ++ String c r ->
  let u := String.length (String c r) in
  here s u = c /\ rest u = String c r /\ u <= l /\ pred u = String.length r /\
  rest (String.length r) = r /\ String.length r < l.
Proof.
  intros L E u. destruct (unapp t l _ L E) as (R & K). fold u in R, K.
  destruct (uncons u c r ltac:(lia) (eq_sym R)) as (l' & U & H & R' & LL). rewrite U in *.
  cbn [pred]. subst l'. repeat split; auto; lia.
Qed.

Lemma member_begin a k b t y r l fuel n done : l <= N -> l <= fuel ->
  rest l = (a ++ quoted k ++ b ++ ":" ++ t) ++ r -> every blank a = true -> spells k y ->
  every blank b = true -> exists f c, fuel = S f /\ c <= f /\ c <= N /\ rest c = t ++ r /\
  read_members (read_value n s) s fuel l done =
    match read_value n s c with
    | Wrong why left' => Wrong why left'
    | Read v after =>
        let next := skip blank s after in
        if (here s next =? ",")%char then
          read_members (read_value n s) s f (pred next) ((y, v) :: done) else
        if (here s next =? "}")%char then
          if unique 24 (fold_left (fun names m => fst m :: names) done [y]) then
            Read (rev_append done [(y, v)]) (pred next)
          else Wrong "a key that appears twice" next
        else Wrong "a comma is missing" next
    end.
Proof.
  intros L F E A K B.
  assert (E' : rest l = a ++ String quote (k ++ String quote (b ++ String ":" (t ++ r)))).
  { rewrite E. unfold quoted. repeat (rewrite ?app_assoc_s; cbn [append]). reflexivity. }
  destruct (skip_blank a l quote _ L E' A eq_refl) as (i & I & H & R & LI).
  destruct (unapp k i _ ltac:(lia) R) as (R1 & K1). cbn [String.length] in K1.
  destruct (uncons (String.length (String quote (b ++ String ":" (t ++ r)))) quote
    (b ++ String ":" (t ++ r)) ltac:(cbn; lia) (eq_sym R1)) as (m & M & _ & R2 & LM).
  destruct (skip_blank b m ":"%char (t ++ r) ltac:(lia) (eq_sym R2) B eq_refl) as (c & C & H2 & R3 &
    LC).
  destruct fuel as [|f]; [lia|]. exists f, c. split; [reflexivity|]. split; [lia|]. split; [lia|].
  split; [exact R3|]. cbn [read_members]. rewrite I, H. cbn [pred].
  change (negb (quote =? quote)%char) with false. cbv iota.
  rewrite (text_complete (S i) k y K i [] _ ltac:(lia) ltac:(lia) R), <- LM, C, H2. reflexivity.
Qed.

Lemma complete :
  (forall n t v, value n t v -> forall l b r, l <= N -> every blank b = true -> rest l = b ++ t ++ r
    ->
    follows r -> read_value n s l = Read v (String.length r)) /\
  (forall n t v, spaced n t v -> forall l r, l <= N -> rest l = t ++ r -> closes r ->
    exists after, read_value n s l = Read v after /\ skip blank s after = String.length r) /\
  (forall n t w, elements n t w -> forall l fuel done r, l <= N -> l <= fuel ->
    rest l = t ++ String "]" r ->
    read_elements (read_value n s) s fuel l done = Read (rev_append done w) (String.length r)) /\
  (forall n t w, members n t w -> forall l fuel done r, l <= N -> l <= fuel ->
    rest l = t ++ String "}" r -> NoDup (map fst (rev_append done w)) ->
    read_members (read_value n s) s fuel l done = Read (rev_append done w) (String.length r)).
Proof.
  assert (Z : forall b t r l c t', l <= N -> every blank b = true -> rest l = b ++ t ++ r ->
    t = String c t' -> blank c = false ->
    let i := skip blank s l in i <= N /\ rest i = t ++ r /\ here s i = c /\
      rest (pred i) = t' ++ r /\ 0 < i).
  { intros b t r l c t' L B E -> C. cbn [append] in *.
    destruct (skip_blank b l c (t' ++ r) L E B C) as (j & J & H & R & LJ). cbv zeta. rewrite J.
    cbn [pred]. rewrite rest_S, H, R by lia. repeat split; auto; lia. }
  apply all_ind.
  - intros n l b r L B E F. rewrite read_value_is. cbv zeta.
    destruct (Z b _ r l _ _ L B E eq_refl eq_refl) as (LI & R & H & _). rewrite H.
    exact (word_complete "null" Null _ r LI R).
  - intros n l b r L B E F. rewrite read_value_is. cbv zeta.
    destruct (Z b _ r l _ _ L B E eq_refl eq_refl) as (LI & R & H & _). rewrite H.
    exact (word_complete "true" (Bool true) _ r LI R).
  - intros n l b r L B E F. rewrite read_value_is. cbv zeta.
    destruct (Z b _ r l _ _ L B E eq_refl eq_refl) as (LI & R & H & _). rewrite H.
    exact (word_complete "false" (Bool false) _ r LI R).
  - intros n t d W l b r L B E F. rewrite read_value_is. cbv zeta.
    destruct (value_first n t _ (a_number n t d W)) as (c & t' & T & FC & _).
    destruct (Z b _ r l c t' L B E T FC) as (LI & R & H & _). rewrite H.
    rewrite (whole_complete t d _ r W LI R F).
    assert (G : digit c = true \/ c = "-"%char).
    { destruct W as [u (A & D & _)|u _ _|]; [|right; cbn in T; congruence|right; cbn in T;
      congruence].
      left. subst u. cbn in D. apply andb_prop in D. tauto. }
    destruct G as [G | ->]; [|reflexivity]. rewrite !(digit_is c G) by reflexivity. reflexivity.
  - intros n t y Sp l b r L B E F. rewrite read_value_is. cbv zeta.
    destruct (Z b _ r l quote (t ++ String quote "") L B E eq_refl eq_refl) as (LI & R & H & R2 &
      P).
    rewrite H, Ascii.eqb_refl. rewrite app_assoc_s in R2. cbn [append] in R2.
    rewrite (text_complete _ t y Sp _ [] r) by (auto; lia). reflexivity.
  - intros n w W l b r L B E F. rewrite read_value_is. cbv zeta.
    destruct (Z b _ r l _ _ L B E eq_refl eq_refl) as (LI & R & H & R2 & P). rewrite H.
    change ("[" =? quote)%char with false. change ("[" =? "[")%char with true. cbv iota.
    set (i := skip blank s l) in *. rewrite app_assoc_s in R2. cbn [append] in R2.
    destruct (skip_blank w (pred i) "]"%char r ltac:(lia) R2 W eq_refl) as (j & -> & H2 & R3 & LJ).
    rewrite H2. cbn. rewrite <- R3, rest_length by lia. reflexivity.
  - intros n t w V IH l b r L B E F. rewrite read_value_is. cbv zeta.
    destruct (Z b _ r l _ _ L B E eq_refl eq_refl) as (LI & R & H & R2 & P). rewrite H.
    change ("[" =? quote)%char with false. change ("[" =? "[")%char with true. cbv iota.
    set (i := skip blank s l) in *. rewrite app_assoc_s in R2. cbn [append] in R2.
    rewrite (IH (pred i) i [] r ltac:(lia) ltac:(lia) R2).
    destruct (elements_first n t w V) as (a & c & u & -> & A & FC & NB).
    rewrite app_assoc_s in R2. cbn [append] in R2.
    destruct (skip_blank a (pred i) c _ ltac:(lia) R2 A FC) as (j & -> & H2 & R3 & LJ).
    rewrite H2, NB. reflexivity.
  - intros n w W l b r L B E F. rewrite read_value_is. cbv zeta.
    destruct (Z b _ r l _ _ L B E eq_refl eq_refl) as (LI & R & H & R2 & P). rewrite H.
    change ("{" =? quote)%char with false. change ("{" =? "[")%char with false.
    change ("{" =? "{")%char with true. cbv iota.
    set (i := skip blank s l) in *. rewrite app_assoc_s in R2. cbn [append] in R2.
    destruct (skip_blank w (pred i) "}"%char r ltac:(lia) R2 W eq_refl) as (j & -> & H2 & R3 & LJ).
    rewrite H2. cbn. rewrite <- R3, rest_length by lia. reflexivity.
  - intros n t w V IH ND l b r L B E F. rewrite read_value_is. cbv zeta.
    destruct (Z b _ r l _ _ L B E eq_refl eq_refl) as (LI & R & H & R2 & P). rewrite H.
    change ("{" =? quote)%char with false. change ("{" =? "[")%char with false.
    change ("{" =? "{")%char with true. cbv iota.
    set (i := skip blank s l) in *. rewrite app_assoc_s in R2. cbn [append] in R2.
    rewrite (IH (pred i) i [] r ltac:(lia) ltac:(lia) R2 ND).
    destruct (members_first n t w V) as (a & u & -> & A).
    rewrite app_assoc_s in R2. cbn [append] in R2.
    destruct (skip_blank a (pred i) quote _ ltac:(lia) R2 A eq_refl) as (j & -> & H2 & R3 & LJ).
    rewrite H2. reflexivity.
  - intros n a t b v A B V IH l r L E (ST & F). rewrite !app_assoc_s in E.
    exists (String.length (b ++ r)). split; [apply (IH l a (b ++ r)); auto; apply follows_blank;
      auto|].
    destruct (unapp (a ++ t) l (b ++ r) L) as (R & K); [rewrite app_assoc_s; exact E|].
    apply (skip_all blank b _ r); auto; lia.
  - intros n t v V IH l fuel done r L F E. destruct (uncons_app t "]" r l L E) as (H & R & U & P &
    R2 & K).
    destruct (IH l (String "]" r) L E (closes_with "]" r eq_refl eq_refl)) as (after & E1 & E2).
    destruct fuel as [|fuel]; [lia|]. cbn [read_elements]. rewrite E1, E2, H, P. reflexivity.
  - intros n t v u w V IH _ IH2 l fuel done r L F E. rewrite !app_assoc_s in E. cbn [append] in E.
    destruct (uncons_app t "," (u ++ String "]" r) l L E) as (H & R & U & P & R2 & K).
    destruct (IH l _ L E (closes_with "," _ eq_refl eq_refl)) as (after & E1 & E2).
    destruct fuel as [|fuel]; [lia|]. cbn [read_elements]. rewrite E1, E2, H, P.
    change ("," =? ",")%char with true. cbv iota.
    rewrite (IH2 (String.length (u ++ String "]" r)) fuel (v :: done) r) by (auto; lia).
      reflexivity.
  - intros n a k b t y v A K B V IH l fuel done r L F E ND.
    destruct (member_begin a k b t y _ l fuel n done L F E A K B) as (f & c & -> & LF & LC & R & M).
    rewrite M. clear M. cbv zeta.
    destruct (uncons_app t "}" r c LC R) as (H & _ & U & P & R2 & KK).
    destruct (IH c (String "}" r) LC R (closes_with "}" r eq_refl eq_refl)) as (after & E1 & E2).
    rewrite E1, E2, H, P. change ("}" =? ",")%char with false. change ("}" =? "}")%char with true.
    cbv iota. apply names_unique, (unique_is 24) in ND. rewrite ND. reflexivity.
  - intros n a k b t y v u w A K B V IH _ IH2 l fuel done r L F E ND.
    assert (E' : rest l = (a ++ quoted k ++ b ++ ":" ++ t) ++ String "," (u ++ String "}" r)).
    { rewrite E. unfold quoted. repeat (rewrite ?app_assoc_s; cbn [append]). reflexivity. }
    destruct (member_begin a k b t y _ l fuel n done L F E' A K B) as (f & c & -> & LF & LC & R &
      M).
    rewrite M. clear M. cbv zeta.
    destruct (uncons_app t "," (u ++ String "}" r) c LC R) as (H & _ & U & P & R2 & KK).
    destruct (IH c _ LC R (closes_with "," _ eq_refl eq_refl)) as (after & E1 & E2).
    rewrite E1, E2, H, P. change ("," =? ",")%char with true. cbv iota.
    rewrite (IH2 (String.length (u ++ String "}" r)) f ((y, v) :: done) r) by (auto; lia).
      reflexivity.
Qed.

(* ---- Files ---- *)
Lemma counted_is test : forall l n, l <= N -> counted test s l n = count test (rest l) n.
Proof.
  induction l as [|l IH]; intros n L; [rewrite rest_0; reflexivity|]. rewrite rest_S by exact L.
  cbn [counted count]. apply IH. lia.
Qed.
Lemma not_utf8_is : forall l next, l <= N ->
  (not_utf8 s l next = None <-> utf8 (rest l) next = true).
Proof.
  induction l as [|l IH]; intros [[n lo] hi] L.
  - rewrite rest_0. destruct n; cbn; split; congruence.
  - rewrite rest_S by exact L. destruct n; cbn [not_utf8 utf8].
    + destruct (letter _) as [next|]; [apply IH; lia|split; congruence].
    + destruct (within _ _ _); cbn [andb]; [apply IH; lia|split; congruence].
Qed.
Lemma parse_sound v l : parse s = Read v l -> json_of s v.
Proof.
  unfold parse. destruct (max_bytes <? _)%N eqn:A; [discriminate|]. apply N.ltb_ge in A.
  destruct (max_marks <? _)%N eqn:B; [discriminate|]. apply N.ltb_ge in B.
  destruct (not_utf8 s N between_letters) eqn:C; [discriminate|]. apply not_utf8_is in C; [|lia].
  rewrite counted_is in B by lia. rewrite rest_all in B, C.
  destruct (read_value max_depth s N) as [w after|] eqn:E; [|discriminate]. cbv zeta.
  destruct (spaced_sound max_depth _ N w after (value_sound max_depth) E) as (K & t & R & V);
    [lia|].
  destruct (skip blank s after) as [|m]; [|discriminate]. intros [= -> _].
  rewrite rest_all, rest_0, app_nil_s in R. subst t. exact (conj A (conj B (conj C V))).
Qed.
Lemma parse_complete v : json_of s v -> parse s = Read v 0.
Proof.
  intros (A & B & C & V). unfold parse. unfold size in A. apply N.ltb_ge in A. rewrite A.
  rewrite counted_is, rest_all by lia. apply N.ltb_ge in B. rewrite B.
  rewrite <- rest_all in C at 1. apply not_utf8_is in C; [|lia]. rewrite C.
  destruct complete as (_ & P & _). destruct (P _ _ _ V N "") as (after & -> & E).
  - lia.
  - rewrite rest_all, app_nil_s. reflexivity.
  - split; intros c t; discriminate.
  - cbv zeta. rewrite E. reflexivity.
Qed.

End Of.

Theorem parse_is s v : (exists left, parse s = Read v left) <-> json_of s v.
Proof.
  split; [intros (l & E); exact (parse_sound s v l E)|]. intro J. exists 0. apply parse_complete, J.
Qed.
Theorem one_value s v w : json_of s v -> json_of s w -> v = w.
Proof. intros V W. apply parse_complete in V, W. congruence. Qed.
