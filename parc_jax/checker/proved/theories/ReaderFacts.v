(* What is read from a value of JSON is what it tells (Format.v). *)
From Coq Require Qreals.
From Coq Require Import Ascii String ZArith QArith Qpower List Bool Arith NArith Lia.
From ParcJax Require Import Spec Arithmetic Checker Polytopes Doubt NoPlan Answer Episode Json Parse
  ParseFacts.
From ParcJax Require Import Format Reader.
From ParcJax Require ArithmeticFacts.
Import ListNotations.
Local Open Scope nat_scope.
Local Open Scope string_scope.

(* ---- Numbers ---- *)
Lemma some_is {A} (x y : A) : Some x = Some y -> x = y.
Proof. congruence. Qed.
Lemma spelled_app b s t : forall n, spelled b n (s ++ t) = spelled b (spelled b n s) t.
Proof. induction s; cbn; auto. Qed.
Lemma digits_is base s t : forall l r piece weight done, l <= String.length s ->
  rest s l = t ++ r ->
  digits base s l (String.length t) piece weight done =
  spelled (Z.of_nat base) (done * Z.of_nat weight + Z.of_nat piece) t.
Proof.
  induction t as [|c t IH]; intros l r piece weight done L E; [reflexivity|].
  change (String c t ++ r) with (String c (t ++ r)) in E.
  destruct (uncons s l c _ L E) as (l' & -> & H & R & _). cbn [digits String.length spelled].
    rewrite H.
  cbn [pred]. destruct (_ <=? _)%nat; rewrite (IH l' r) by (auto; lia); f_equal; lia.
Qed.
Lemma all_digits_is s l least most z : l <= String.length s -> (1 <= least)%nat ->
  all_digits s l least most = Some z -> some digit (rest s l) /\ z = spelled 10 0 (rest s l).
Proof.
  unfold all_digits. intros L G E. destruct (_ && _) eqn:C; [|discriminate].
  rewrite !andb_true_iff, !Nat.leb_le, Nat.eqb_eq in C. destruct C as ((A & B) & C).
  destruct (skip_is s digit l L) as (t & R & D & _). rewrite C, rest_0, app_nil_s in R. subst t.
  injection E as <-. split.
  - split; [|exact D]. intro X. pose proof (rest_length s l L) as Y. rewrite X in Y. cbn in Y. lia.
  - rewrite <- (rest_length s l L) at 2. rewrite (digits_is ten s (rest s l) l ""); auto.
    rewrite app_nil_s. reflexivity.
Qed.
Lemma exponent_of most s l e : l <= String.length s -> exponent most s l = Some e ->
  exponent_is (rest s l) e.
Proof.
  unfold exponent. intros L E. destruct (here s l =? "-")%char eqn:M.
  - destruct (here_S s l "-" L ltac:(discriminate) M) as (j & -> & R). cbn [pred] in E.
    destruct (all_digits s j 1 most) as [z|] eqn:D; [|discriminate]. injection E as <-.
    destruct (all_digits_is s j 1 most z ltac:(lia) ltac:(lia) D) as (S & ->).
    exists (rest s j). split; [exact S|]. right. rewrite R. auto.
  - destruct (here s l =? "+")%char eqn:P.
    + destruct (here_S s l "+" L ltac:(discriminate) P) as (j & -> & R). cbn [pred] in E.
      destruct (all_digits_is s j 1 most e ltac:(lia) ltac:(lia) E) as (S & ->).
      exists (rest s j). split; [exact S|]. left. rewrite R. auto.
    + destruct (all_digits_is s l 1 most e ltac:(lia) ltac:(lia) E) as (S & ->).
      exists (rest s l). split; [exact S|]. left. auto.
Qed.
Lemma pointed_is test base s l a b z r : l <= String.length s ->
  read_pointed test base s l = (a, b, z, r) -> (1 <= a)%nat ->
  exists t, rest s l = t ++ rest s r /\ r <= l /\ pointed test (Z.of_nat base) t z b /\
    ((a + r)%nat = l -> some test t /\ z = spelled (Z.of_nat base) 0 t).
Proof.
  unfold read_pointed. intros L E A.
  destruct (skip_is s test l L) as (t & R & V & LE & SL & _). set (p := skip test s l) in *.
  assert (T : String.length t = l - p) by (rewrite <- SL; apply slice_length; lia).
  assert (D : digits base s l (l - p) 0 1 0 = spelled (Z.of_nat base) 0 t).
  { rewrite <- T, (digits_is base s t l _ _ _ _ L R). reflexivity. }
  assert (S : a = l - p -> some test t).
  { intros ->. split; [|exact V]. intros ->. cbn in T. lia. }
  rewrite D in E. destruct (here s p =? ".")%char eqn:P.
  - destruct (here_S s p "." ltac:(lia) ltac:(discriminate) P) as (q & EQ & RP).
    rewrite EQ in E. cbn [pred] in E.
    destruct (skip_is s test q ltac:(lia)) as (u & RU & VU & LU & SU & _).
    assert (U : String.length u = q - skip test s q) by (rewrite <- SU; apply slice_length; lia).
    injection E as <- <- <- <-. rewrite <- EQ in *.
    exists (t ++ "." ++ u). rewrite R, RP, RU, !app_assoc_s. split; [reflexivity|]. split; [lia|].
    split; [|intro; lia]. exists t, u. split; [apply S; reflexivity|]. split; [exact VU|].
    split; [right; reflexivity|]. split; [|symmetry; exact U].
    rewrite <- U, (digits_is base s u q _ _ _ _ ltac:(lia) RU), spelled_app. f_equal. lia.
  - injection E as <- <- <- <-. exists t. split; [exact R|]. split; [lia|].
    rewrite Nat.sub_diag. cbn [digits].
    replace (spelled (Z.of_nat base) 0 t * Z.of_nat 1 + Z.of_nat 0)%Z with
      (spelled (Z.of_nat base) 0 t) by lia.
    split; [|intros _; auto]. exists t, "".
    split; [apply S; reflexivity|]. split; [reflexivity|]. split; [left; auto|].
    rewrite app_nil_s. auto.
Qed.

Lemma power_is base e : power base e = (base ^ Z.pos e)%Z.
Proof.
  induction e as [e IH|e IH|]; cbn [power]; rewrite ?IH.
  - rewrite Pos2Z.inj_xI, Z.pow_add_r, Z.pow_twice_r by lia. ring.
  - rewrite Pos2Z.inj_xO, Z.pow_twice_r. reflexivity.
  - symmetry. apply Z.pow_1_r.
Qed.
Lemma raised_is base z e n p : raised base z e = (n, Zpos p) -> (n # p == scaled z base e)%Q.
Proof.
  unfold raised, scaled. rewrite Qmake_Qdiv. destruct e as [|e|e]; intros [= <- E].
  - rewrite <- E. cbn. field.
  - rewrite <- E, power_is, inject_Z_mult, Zpower_Qpower by lia. field.
  - rewrite <- E, power_is, Zpower_Qpower by lia. cbn [Qpower]. reflexivity.
Qed.
Lemma read_hex_is s l n p : l <= String.length s -> read_hex s l = Some (n, Zpos p) ->
  exists x, unsigned_is ("0x" ++ rest s l) x /\ (n # p == x)%Q.
Proof.
  unfold read_hex. intros L E. destruct (read_pointed hex_digit sixteen s l) as [[[a b] z] r] eqn:P.
  destruct (_ && _) eqn:C; [|discriminate]. rewrite !andb_true_iff, !Nat.leb_le in C.
  destruct C as (((A & _) & _) & C). destruct (exponent 4 s (pred r)) as [e|] eqn:X;
    [|discriminate].
  destruct (pointed_is _ _ s l a b z r L P A) as (t & R & LR & T & _).
  destruct (here_S s r "p" ltac:(lia) ltac:(discriminate) C) as (j & -> & RJ). cbn [pred] in X.
  apply exponent_of in X; [|lia]. apply some_is in E. apply raised_is in E.
  exists (scaled z 2 (e - 4 * Z.of_nat b)). split; [|exact E]. rewrite R, RJ.
  apply hexadecimal; assumption.
Qed.
Lemma read_decimal_is s l n p : l <= String.length s -> read_decimal s l = Some (n, Zpos p) ->
  exists x, unsigned_is (rest s l) x /\ (n # p == x)%Q.
Proof.
  unfold read_decimal. intros L E. destruct (read_pointed digit ten s l) as [[[a b] z] r] eqn:P.
  destruct (Nat.eqb_spec a 0) as [A|A]; [discriminate|].
  destruct (pointed_is _ _ s l a b z r L P ltac:(lia)) as (t & R & LR & T & S).
  destruct (_ && _) eqn:C.
  - apply andb_prop in C as (C & D). apply Nat.eqb_eq in D. destruct (S D) as (S1 & S2).
    destruct (here_S s r "/" ltac:(lia) ltac:(discriminate) C) as (j & -> & RJ). cbn [pred] in E.
    destruct (all_digits s j 1 l) as [d|] eqn:X; [|discriminate].
    destruct (all_digits_is s j 1 l d ltac:(lia) ltac:(lia) X) as (S3 & S4).
    cbn [option_map] in E. injection E as <- ->. rewrite R, RJ.
    exists (inject_Z (spelled 10 0 t) / inject_Z (spelled 10 0 (rest s j)))%Q.
    split; [apply ratio; auto; rewrite <- S4; discriminate|]. rewrite <- S4, S2. apply Qmake_Qdiv.
  - destruct ((a + r <? l)%nat && (b =? 0)%nat); [discriminate|]. destruct r as [|r].
    + apply some_is in E. apply raised_is in E. rewrite rest_0, app_nil_s in R. rewrite R.
      eexists. split; [apply decimal; exact T|exact E].
    + destruct (here s (Datatypes.S r) =? "e")%char eqn:X; [|discriminate].
      destruct (exponent 3 s r) as [e|] eqn:Y; [|discriminate]. apply some_is in E. apply raised_is
        in E.
      apply exponent_of in Y; [|lia]. apply Ascii.eqb_eq in X.
      rewrite (rest_S s r) in R by lia. rewrite X in R. rewrite R.
      eexists. split; [apply (scientific t z b); eassumption|exact E].
Qed.
Lemma red_is q : (red q == q)%Q.
Proof.
  unfold red. destruct (_ / _)%Z; try reflexivity. destruct (Qeq_bool _ _) eqn:E; [|reflexivity].
  apply Qeq_bool_iff, E.
Qed.
Lemma number_of v q : number v = Fine q -> number_is v q.
Proof.
  destruct v as [ | | |s| | ]; try discriminate. cbn [number]. destruct (_ <? _)%N; [discriminate|].
  destruct (read_number s) as [[n d]|] eqn:E; [|discriminate]. unfold fraction.
  destruct d as [|p|p]; try discriminate. destruct (_ <=? _)%Z; [discriminate|]. intros [= <-].
  unfold read_number in E. set (N := String.length s) in *.
  set (i := if (here s N =? "-")%char then pred N else N) in *.
  assert (LI : i <= N) by (unfold i; destruct (_ =? _)%char; lia).
  destruct (if slice s i (i - 2) =? "0x" then _ else _) as [[n' d']|] eqn:X; [|discriminate].
  injection E as E ->.
  assert (U : exists x, unsigned_is (rest s i) x /\ (n' # p == x)%Q).
  { destruct (slice s i (i - 2) =? "0x") eqn:H; [|apply read_decimal_is; auto].
    apply String.eqb_eq in H. rewrite (slice_rest s i (i - 2)), H by lia.
    apply read_hex_is; [lia|exact X]. }
  destruct U as (x & U & V). exists (rest s i), x. split; [exact U|]. rewrite red_is.
  destruct (here s N =? "-")%char eqn:M.
  - right. destruct (here_S s N "-" ltac:(lia) ltac:(discriminate) M) as (j & J & R).
    assert (I : i = j) by (unfold i; lia). unfold N in R. rewrite rest_all in R. rewrite I.
    split; [rewrite R at 1; reflexivity|]. rewrite <- V, <- E. reflexivity.
  - left. assert (I : i = N) by reflexivity. rewrite I. unfold N. rewrite rest_all.
    split; [reflexivity|]. rewrite <- E. exact V.
Qed.
Lemma number_is_eq v x y : number_is v x -> (y == x)%Q -> number_is v y.
Proof.
  intros (s & z & U & [(V & W) | (V & W)]) E; exists s, z; split; auto; rewrite E; auto.
Qed.

(* ---- Lists, pairs and objects ---- *)
Lemma bind_is {A B} (r : result A) (f : A -> result B) y : bind r f = Fine y ->
  exists x, r = Fine x /\ f x = Fine y.
Proof. destruct r; cbn; [eauto|discriminate]. Qed.
Lemma check_is ok why u : check ok why = Fine u -> ok = true.
Proof. destruct ok; [reflexivity|discriminate]. Qed.
Lemma fine_is {A} (x y : A) : Fine x = Fine y -> x = y.
Proof. congruence. Qed.
(* Each step of a reader, and what it read. *)
Ltac steps H :=
  repeat match type of H with bind _ _ = Fine _ =>
    apply bind_is in H; let x := fresh "x" in let E := fresh "E" in destruct H as (x & E & H) end;
  try match type of H with Fine _ = Fine _ => apply fine_is in H; subst end.

Lemma onto_is {A B} (f : A -> result B) l : forall done out, onto f l done = Fine out ->
  exists l', out = rev_append done l' /\ Forall2 (fun x y => f x = Fine y) l l'.
Proof.
  induction l as [|x l IH]; intros done out E; cbn in E.
  - apply fine_is in E. exists []. split; [symmetry; exact E|constructor].
  - destruct (f x) as [y|] eqn:F; [|discriminate]. destruct (IH _ _ E) as (l' & -> & Q).
    exists (y :: l'). split; [reflexivity|]. constructor; assumption.
Qed.
Lemma each_is {A B} (f : A -> result B) l l' : each f l = Fine l' ->
  Forall2 (fun x y => f x = Fine y) l l'.
Proof. intro E. destruct (onto_is f l [] l' E) as (m & -> & Q). exact Q. Qed.
Lemma many_is {A} (l : list A) : many l = length l.
Proof.
  unfold many. enough (H : forall n, fold_left (fun n (_ : A) => S n) l n = (n + length l)%nat)
    by apply H.
  induction l as [|x l IH]; intro n; cbn; [lia|]. rewrite IH. lia.
Qed.
Lemma Forall2_imp {A B} (P Q : A -> B -> Prop) l m : (forall x y, P x y -> Q x y) ->
  Forall2 P l m -> Forall2 Q l m.
Proof. induction 2; constructor; auto. Qed.
Lemma Forall2_len {A B} (P : A -> B -> Prop) l m : Forall2 P l m -> length l = length m.
Proof. induction 1; cbn; congruence. Qed.

(* A reader that reads what is told. *)
Definition reads {A} (f : json -> result A) (is : json -> A -> Prop) : Prop :=
  forall v x, f v = Fine x -> is v x.
Lemma list_reads {A} (f : json -> result A) is : reads f is -> reads (list_of f) (list_is is).
Proof.
  intros R v l E. unfold list_of in E. steps E. destruct v; try discriminate.
  apply fine_is in E0. subst. exists x. split; [reflexivity|].
  apply each_is in E. eapply Forall2_imp; [|exact E]. exact R.
Qed.
Lemma sized_list {A} n (f : json -> result A) v l : sized n f v = Fine l ->
  list_of f v = Fine l /\ length l = n.
Proof.
  unfold sized, list_of. intro E. steps E. apply check_is, Nat.eqb_eq in E1. rewrite many_is in E1.
  rewrite E0. split; [exact E|]. apply each_is, Forall2_len in E. congruence.
Qed.
Lemma sized_reads {A} n (f : json -> result A) is : reads f is -> reads (sized n f) (list_is is).
Proof. intros R v l E. apply sized_list in E as (E & _). eapply list_reads; eauto. Qed.
Lemma pair_reads {A B} (f : json -> result A) (g : json -> result B) is is' :
  reads f is -> reads g is' -> reads (pair_of f g) (pair_is is is').
Proof.
  intros R S v p E. destruct v as [ | | | |[|a [|b [|c l]]]| ]; try discriminate. cbn in E. steps E.
  exists a, b. cbn. auto.
Qed.

Lemma look_in name o v : look name o = Some v -> In (name, v) o.
Proof.
  induction o as [|(k, w) o IH]; cbn; [discriminate|]. destruct (String.eqb_spec k name) as [->|].
  - intros [= ->]. auto.
  - auto.
Qed.
Lemma look_none name o : look name o = None -> forall v, ~ In (name, v) o.
Proof.
  induction o as [|(k, w) o IH]; cbn; [auto|]. destruct (String.eqb_spec k name) as [->|N];
    [discriminate|].
  intros E v [X|X]; [congruence|]. exact (IH E v X).
Qed.
Lemma get_in name o v : get name o = Fine v -> In (name, v) o.
Proof. unfold get. destruct (look name o) eqn:E; [|discriminate]. intros [= <-]. apply look_in, E.
  Qed.
Lemma field_reads {A} name (f : json -> result A) is o x : reads f is -> field name f o = Fine x ->
  field_is name is o x.
Proof. intros R E. unfold field in E. steps E. exists x0. split; [apply get_in, E0|apply R, E]. Qed.
Lemma among_is name names : among name names = true <-> In name names.
Proof.
  unfold among. rewrite existsb_exists. split.
  - intros (y & I & E). apply String.eqb_eq in E. subst. exact I.
  - intro I. exists name. split; [exact I|apply String.eqb_refl].
Qed.
Lemma object_reads names optional : reads (object names optional) (object_is names optional).
Proof.
  intros v o E. destruct v as [ | | | | |l]; try discriminate. cbn in E.
  destruct (find _ l) as [[k w]|] eqn:F; [discriminate|]. steps E. split; [reflexivity|]. split.
  - intros name I. apply each_is in E0. clear F. induction E0 as [|k w ks ws G _ IH]; [destruct I|].
    destruct I as [->|I]; [eauto using get_in|auto].
  - intros name w I. pose proof (find_none _ _ F _ I) as K. cbn in K.
    apply negb_false_iff, orb_prop in K. rewrite !among_is in K. exact K.
Qed.

Lemma list_is_eq v l m : vec_is v l -> Forall2 (fun x y => y == x)%Q l m -> vec_is v m.
Proof.
  intros (vs & -> & F) E. exists vs. split; [reflexivity|]. revert m E.
  induction F as [|w x ws l X F IH]; intros m E; inversion E; subst; constructor; auto.
  eapply number_is_eq; eauto.
Qed.
Lemma over_is d x y : over d x = Fine y -> (y == x)%Q.
Proof.
  unfold over. destruct d as [|p|]; try discriminate. set (m := (Z.pos p / Zpos (Qden x))%Z).
  destruct (Z.eqb_spec (Zpos (Qden x) * m) (Z.pos p)) as [E|]; [|discriminate].
  destruct (_ <=? _)%Z; [discriminate|]. intros [= <-]. unfold Qeq. cbn [Qnum Qden].
  rewrite <- E. ring.
Qed.
Lemma over_each d l m : each (over d) l = Fine m -> Forall2 (fun x y => y == x)%Q l m.
Proof. intro E. apply each_is in E. eapply Forall2_imp; [|exact E]. apply over_is. Qed.
Lemma leveled_is l m : leveled l = Fine m -> Forall2 (fun x y => y == x)%Q l m.
Proof. unfold leveled. intro E. steps E. apply over_each in E. exact E. Qed.
Lemma level_is (rows : list (vec * Q)) A : level rows = Fine A ->
  Forall2 (fun r a => Forall2 (fun x y => y == x)%Q (fst r) (fst a) /\ snd a == snd r)%Q rows A.
Proof.
  unfold level. intro E. steps E. apply each_is in E. eapply Forall2_imp; [|exact E].
  intros r a F. cbn in F. steps F. cbn. split; [apply over_each in E1; exact E1|eapply over_is;
    eauto].
Qed.
Lemma number_reads : reads number number_is.
Proof. exact number_of. Qed.
Lemma numbers_read : reads numbers_of vec_is.
Proof. apply list_reads, number_reads. Qed.
Lemma vec_reads n : reads (numbers_in n) vec_is.
Proof. apply sized_reads, number_reads. Qed.
Lemma short_reads n : reads (short_numbers n) vec_is.
Proof.
  intros v l E. unfold short_numbers in E. steps E. eapply list_is_eq; [eapply vec_reads, E0|].
  apply leveled_is, E.
Qed.

Lemma spelled_nat s : forall n, spelled 10 (Z.of_nat n) s = Z.of_nat (fold_left
  (fun v c => (v * ten + value_of c)%nat) (list_ascii_of_string s) n).
Proof.
  induction s as [|c s IH]; intro n; [reflexivity|]. cbn [spelled list_ascii_of_string fold_left].
  rewrite <- IH. f_equal. unfold ten. lia.
Qed.
Lemma index_reads least most : reads (index least most) index_is.
Proof.
  intros v i E. destruct v as [ | |s| | | ]; try discriminate. cbn [index] in E. cbv zeta in E.
  destruct (Nat.eqb_spec (skip digit s (String.length s)) 0) as [K|]; [|discriminate].
  destruct (_ <=? _)%N; [|discriminate]. steps E. exists s. split; [reflexivity|].
  destruct (skip_is s digit (String.length s) (le_n _)) as (t & R & D & _).
  rewrite K, rest_0, rest_all, app_nil_s in R. subst t. split; [exact D|].
  symmetry. exact (spelled_nat s 0).
Qed.
Lemma below_reads n : reads (below n) index_is.
Proof. intros v i E. unfold below in E. steps E. eapply index_reads, E0. Qed.

(* ---- Problem, network, tube ---- *)
(* a list of rows over one denominator *)
Lemma rows_leveled a b A va vb : list_is vec_is va a -> vec_is vb b -> length a = length b ->
  Forall2 (fun r x => Forall2 (fun x y => y == x)%Q (fst r) (fst x) /\ snd x == snd r)%Q
    (combine a b) A ->
  exists a' b', list_is vec_is va a' /\ vec_is vb b' /\ length a' = length b' /\ A = combine a' b'.
Proof.
  intros (vs & -> & F) (ws & -> & G) L Q. exists (map fst A), (map snd A).
  assert (H : Forall2 vec_is vs (map fst A) /\ Forall2 number_is ws (map snd A)).
  { revert b ws A G L Q. induction F as [|v x vs a X F IH]; intros b ws A G L Q;
      destruct b as [|y b]; try discriminate; inversion G; subst; inversion Q; subst; cbn.
    - split; constructor.
    - match goal with H : _ /\ _ |- _ => cbn in H; destruct H as (Q1 & Q2) end.
      edestruct IH as (I1 & I2); eauto.
      split; constructor; auto; [eapply list_is_eq; eauto|eapply number_is_eq; eauto]. }
  destruct H as (H1 & H2). split; [exists vs; auto|]. split; [exists ws; auto|].
  split; [rewrite !map_length; reflexivity|]. clear.
  induction A as [|[w y] A IH]; cbn; [reflexivity|]. rewrite <- IH. reflexivity.
Qed.
Lemma rows_read n o A : rows_of n o = Fine A -> rows_are o A.
Proof.
  unfold rows_of. intro E. steps E. unfold field in E0, E1. steps E0. steps E1.
  apply sized_list in E1 as (E1 & L). rewrite many_is in L.
  edestruct (rows_leveled x x0 A) as (a' & b' & U & V & W & ->).
  - eapply list_reads; [apply vec_reads|exact E0].
  - eapply list_reads; [apply number_reads|exact E1].
  - congruence.
  - apply level_is, E.
  - exists a', b'. repeat split; auto; eexists; eauto using get_in.
Qed.
Lemma poly_reads n : reads (poly_of n) poly_is.
Proof.
  intros v A E. unfold poly_of in E. steps E. apply object_reads in E0. exists x.
  split; [exact E0|]. eapply rows_read, E.
Qed.
Lemma box_reads n : reads (box_of n) box_is.
Proof.
  intros v B E. unfold box_of in E. steps E. apply object_reads in E0. exists x, x0, x1.
  split; [exact E0|]. pose proof E1 as L1. pose proof E2 as L2.
  unfold field in L1, L2. steps L1. steps L2. apply sized_list in L1 as (_ & L1), L2 as (_ & L2).
  split; [eapply field_reads; [apply vec_reads|exact E1]|].
  split; [eapply field_reads; [apply vec_reads|exact E2]|]. split; [congruence|reflexivity].
Qed.
Lemma obstacle_reads n steps : reads (obstacle_of n steps) (obstacle_is steps).
Proof.
  intros v o E. unfold obstacle_of in E. steps E. apply object_reads in E0. apply rows_read in E1.
  exists x. split; [exact E0|]. destruct (look "steps" x) as [w|] eqn:K.
  - destruct w as [ | | | |[|a [|b [|c l]]]| ]; try discriminate. steps E. cbn.
    split; [exact E1|]. left. exists (Arr [a; b]). split; [apply look_in, K|]. exists a, b. cbn.
    split; [reflexivity|]. split; eapply below_reads; eauto.
  - apply fine_is in E. subst o. cbn. split; [exact E1|]. right. split; [apply look_none, K|auto].
Qed.
Lemma part_reads n points : reads (part_of n points) part_is.
Proof.
  intros v p E. unfold part_of in E. steps E. apply object_reads in E0. exists x.
  split; [exact E0|]. eapply field_reads in E1; [|apply list_reads, below_reads].
  destruct (look "radius" x) as [r|] eqn:K, (look "vertices" x) as [vs|] eqn:K2; try discriminate;
    steps E; cbn; (split; [exact E1|]); (split; [|apply look_none; assumption]); eexists;
    (split; [apply look_in; eassumption|]).
  - apply number_reads, E2.
  - eapply list_reads; [apply vec_reads|exact E2].
Qed.
Lemma problem_reads : reads problem_of problem_is.
Proof.
  intros v P E. unfold problem_of in E. steps E. apply object_reads in E0. exists x.
  split; [exact E0|]. cbn.
  repeat (split; [eapply field_reads; [|eassumption]; try apply index_reads; try apply box_reads;
    try apply poly_reads; try (apply list_reads, obstacle_reads)|]).
  - intros w A F. destruct w; try (right; eapply poly_reads, F). left.
    apply fine_is in F. subst. auto.
  - eapply field_reads; [|eassumption]. intros w l F. cbv beta in F. steps F.
    apply object_reads in E. eexists. split; [exact E|]. eapply field_reads; [apply list_reads,
      part_reads|exact F].
Qed.
Lemma layer_is wb L : layer_of wb = Fine L -> length (fst wb) = length (snd wb) /\
  level (combine (fst wb) (snd wb)) = Fine L.
Proof.
  intro E. unfold layer_of in E. steps E. apply check_is, Nat.eqb_eq in E0. rewrite !many_is in E0.
    auto.
Qed.
Lemma layers_are w b N : length w = length b -> each layer_of (combine w b) = Fine N ->
  forall ws bs, Forall2 (list_is vec_is) ws w -> Forall2 vec_is bs b ->
  exists w' b', Forall2 (list_is vec_is) ws w' /\ Forall2 vec_is bs b' /\ length w' = length b' /\
    Forall2 (fun wb L => length (fst wb) = length (snd wb) /\ L = combine (fst wb) (snd wb))
      (combine w' b') N.
Proof.
  intros L E ws bs W. apply each_is in E. revert b N bs L E.
  induction W as [|v x ws w X W IH]; intros b N bs L E B; destruct b as [|y b]; try discriminate;
    inversion B; subst; cbn in E; inversion E; subst.
  - exists [], []. repeat split; constructor.
  - match goal with H : layer_of _ = _ |- _ => apply layer_is in H as (LN & LV); cbn in LN, LV;
      apply level_is in LV end.
    edestruct (rows_leveled x y) as (a' & b' & U & V & K & ->); eauto.
    edestruct IH as (w' & b'' & U' & V' & K' & Q); eauto.
    exists (a' :: w'), (b' :: b''). cbn. repeat split; try constructor; auto.
Qed.
Lemma network_reads : reads network_of network_is.
Proof.
  intros v N E. unfold network_of in E. steps E. apply object_reads in E0.
  pose proof E3 as L. unfold field in E1, E3. steps E1. steps E3.
  apply sized_list in E3 as (E3 & LB). rewrite many_is in LB.
  apply (list_reads _ _ (list_reads _ _ numbers_read)) in E1 as (ws & -> & W).
  apply (list_reads _ _ numbers_read) in E3 as (bs & -> & B).
  destruct (layers_are x0 x2 N ltac:(congruence) E ws bs W B) as (w' & b' & U & V & K & Q).
  exists x, w', b'. split; [exact E0|]. split; [eexists; split; [apply get_in; eassumption|exists
    ws; auto]|].
  split; [eexists; split; [apply get_in; eassumption|exists bs; auto]|]. auto.
Qed.
Lemma pairs_are (l : list (nat * Q)) m vs : Forall2 (pair_is index_is number_is) vs l ->
  Forall2 (fun x y => y == x)%Q (map snd l) m ->
  Forall2 (pair_is index_is number_is) vs (combine (map fst l) m).
Proof.
  intro F. revert m. induction F as [|v (i, x) vs l (a & b & -> & I & X) F IH]; intros m Q; cbn in
    *;
    inversion Q; subst; constructor; auto. exists a, b. cbn. split; [reflexivity|].
  split; [exact I|]. eapply number_is_eq; eauto.
Qed.
Lemma multipliers_read n : reads (multipliers_of n) multipliers_are.
Proof.
  intros v m E. unfold multipliers_of in E. steps E.
  apply (list_reads _ _ (pair_reads _ _ _ _ (below_reads n) number_reads)) in E0 as (vs & -> & F).
  exists vs. split; [reflexivity|]. apply pairs_are; [exact F|]. apply leveled_is, E1.
Qed.
Lemma error_reads n : reads (error_of n) error_is.
Proof.
  intros v X E. unfold error_of in E. destruct v; steps E; cbn;
    [eapply short_reads; eassumption..|eapply poly_reads; eassumption].
Qed.
Lemma final_reads P : reads (final_of P) final_is.
Proof.
  intros v X E. unfold final_of in E. destruct v; steps E; cbn;
    try (split; [eapply short_reads; eassumption|reflexivity]).
  match goal with H : object _ _ _ = _ |- _ => apply object_reads in H; eexists; split; [exact H|]
    end.
  split; [eapply rows_read; eassumption|]. eapply field_reads; [|eassumption].
  apply sized_reads, list_reads, multipliers_read.
Qed.
Lemma tube_reads P : reads (tube_of P) tube_is.
Proof.
  intros v EH E. unfold tube_of in E. steps E. apply object_reads in E0. exists x. eexists.
  split; [exact E0|]. cbn. split; [eapply field_reads; [apply sized_reads,
    numbers_read|eassumption]|].
  split; [eapply field_reads; [|eassumption]; apply list_reads, sized_reads, sized_reads,
    error_reads|].
  split; [eapply field_reads; [|eassumption]; apply list_reads, final_reads|]. auto.
Qed.

(* ---- Entries ---- *)
Lemma runs_read n m : reads (run_of n m) (pair_is index_is multipliers_are).
Proof. apply pair_reads; [apply index_reads|apply multipliers_read]. Qed.
Lemma sep_reads P : reads (sep_of P) sep_is.
Proof.
  intros v s E. unfold sep_of in E. steps E. apply sized_list in E0 as (E0 & L). rewrite many_is in
    L.
  unfold list_of in E0. steps E0. destruct v; try discriminate. apply fine_is in E1. subst.
  assert (x0 = x) as ->.
  { apply each_is in E0. clear - E0. induction E0; [reflexivity|]. f_equal; [congruence|assumption].
    }
  exists x. split; [reflexivity|]. apply each_is in E. clear - E L. revert s E.
  revert x L. induction (obstacles P) as [|o os IH]; intros x L s E; destruct x as [|w x]; try
    discriminate;
    cbn in E; inversion E; subst; constructor; auto. eapply sized_reads; [|eassumption].
  apply list_reads, runs_read.
Qed.
Lemma sample_reads P : reads (sample_of P) sample_is.
Proof.
  intros v s E. unfold sample_of in E. steps E. apply object_reads in E0. exists x. cbn.
  split; [exact E0|]. split; [eapply field_reads; [apply short_reads|eassumption]|].
  split; [eapply field_reads; [apply short_reads|eassumption]|].
  eapply field_reads; [apply sep_reads|eassumption].
Qed.

Definition sign (b : bool) : ascii := if b then "1"%char else "0"%char.
Lemma bits_are s n : forall l done out, l <= String.length s -> bits s l n done = Fine out ->
  exists bs, out = rev_append done bs /\ n <= l /\
    list_ascii_of_string (rest s l) = (map sign bs ++ list_ascii_of_string (rest s (l - n)))%list.
Proof.
  induction n as [|n IH]; intros l done out L E; cbn in E.
  - apply fine_is in E. exists []. rewrite Nat.sub_0_r. subst. repeat split. lia.
  - assert (C : exists b, here s l = sign b /\ bits s (pred l) n (b :: done) = Fine out).
    { destruct (here s l =? "1")%char eqn:A; [exists true|destruct (here s l =? "0")%char eqn:B;
        [exists false|discriminate]]; split; auto; apply Ascii.eqb_eq; assumption. }
    destruct C as (b & H & C). destruct l as [|l].
    { rewrite here_0 in H. destruct b; discriminate. }
    cbn [pred] in C. destruct (IH l (b :: done) out ltac:(lia) C) as (bs & -> & LE & R).
    exists (b :: bs). split; [reflexivity|]. split; [lia|]. rewrite rest_S, H by exact L.
    cbn. f_equal. exact R.
Qed.
Lemma pattern_reads N s : forall l bs, l <= String.length s -> pattern_of N s l = Fine bs ->
  list_ascii_of_string (rest s l) = map sign (concat bs).
Proof.
  induction N as [|L N IH]; intros l bs LE E; cbn in E;
    [|destruct N as [|M N]];
    try (steps E; apply check_is, Nat.eqb_eq in E0; subst; rewrite rest_0; reflexivity).
  steps E. destruct (bits_are s (many L) l [] x LE E0) as (b & -> & K & R).
  cbn [rev_append concat]. rewrite map_app, R. f_equal. apply IH; [lia|exact E1].
Qed.
Lemma piece_reads P N : reads (piece_of P N) piece_is.
Proof.
  intros v s E. unfold piece_of in E. steps E. apply object_reads in E0.
  apply leveled_is, Forall2_app_inv_l in E3 as (p0 & k & F & G & ->).
  eapply field_reads in E1; [|apply vec_reads]. eapply field_reads in E2; [|apply vec_reads].
  destruct E1 as (v1 & I1 & V1), E2 as (v2 & I2 & V2). exists x, p0, k. cbn.
  split; [exact E0|]. split; [exists v1; split; [exact I1|eapply list_is_eq; eauto]|].
  split; [exists v2; split; [exact I2|eapply list_is_eq; eauto]|]. split; [reflexivity|].
  split; [eapply field_reads; [apply index_reads|eassumption]|]. split.
  - eapply field_reads; [|eassumption]. intros w bs B. destruct w; try discriminate. cbn in B.
    exists s. split; [reflexivity|]. pose proof (pattern_reads N s _ bs (le_n _) B) as Y.
    rewrite rest_all in Y. exact Y.
  - eapply field_reads; [apply sep_reads|eassumption].
Qed.
Lemma qadd_is a b : (qadd a b == a + b)%Q.
Proof. apply Qreals.eqR_Qeq. rewrite ArithmeticFacts.R_add, Qreals.Q2R_plus. reflexivity. Qed.
Lemma sides_are l : Forall2 (fun kr I => fst I == fst kr - snd kr /\ snd I == fst kr + snd kr)%Q
  l (map side_of l).
Proof.
  induction l as [|(k, r) l IH]; cbn; constructor; auto. cbn. rewrite !qadd_is. split; reflexivity.
Qed.
Lemma widths_read n : reads (widths_of n) vec_is.
Proof. intros v e E. unfold widths_of in E. steps E. eapply short_reads, E0. Qed.
Lemma widths_length n v e : widths_of n v = Fine e -> length e = n.
Proof.
  intro E. unfold widths_of in E. steps E. unfold short_numbers in E0. steps E0.
  apply leveled_is, Forall2_len in E0. apply sized_list in E as (_ & E). congruence.
Qed.
Lemma boxed_reads P : reads (boxed_of P) boxed_is.
Proof.
  intros v s E. unfold boxed_of in E. steps E. apply object_reads in E0. exists x, x1, x2, x4. cbn.
  assert (L : length x1 = n_k P /\ length x4 = n_k P).
  { split; [pose proof E2 as X; unfold field in X; steps X; apply sized_list in X; tauto|].
    pose proof E5 as X. unfold field in X. steps X. apply widths_length in X. exact X. }
  destruct L as (L1 & L2).
  split; [exact E0|]. split; [eapply field_reads; [apply short_reads|eassumption]|].
  split; [eapply field_reads; [apply vec_reads|eassumption]|].
  split; [eapply field_reads; [apply object_reads|eassumption]|].
  split; [eapply field_reads; [apply widths_read|eassumption]|].
  split; [eapply field_reads; [apply widths_read|eassumption]|]. split; [congruence|].
  split; [apply sides_are|]. eapply field_reads; [apply sep_reads|eassumption].
Qed.

(* ---- No plan, and volumes ---- *)
Lemma group_reads P n : reads (group_of P n) group_is.
Proof.
  intros v g E. unfold group_of in E. steps E. cbn.
  refine (pair_reads _ _ _ _ (vec_reads n) _ _ _ E0). apply list_reads. intros w c F. steps F. cbn.
  exact (pair_reads _ _ _ _ numbers_read (sized_reads _ _ _ (vec_reads _)) _ _ E).
Qed.
Lemma hit_reads P : reads (hit_of P) hit_is.
Proof.
  intros v h E. unfold hit_of in E.
  destruct v as [ | | | |[|a [|b [|c [|d [|e [|f l]]]]]]| ]; try discriminate. cbv zeta in E. steps
    E.
  exists a, b, c, d, e. cbn. split; [reflexivity|]. split; [eapply below_reads; eauto|].
  split; [eapply below_reads; eauto|]. split; [eapply below_reads; eauto|].
  split; [apply number_of; assumption|]. eapply list_reads; [apply group_reads|eassumption].
Qed.
Lemma use_reads P : reads (use_of P) use_is.
Proof.
  intros v u E. unfold use_of in E. cbv zeta in E.
  destruct v as [ | | | |[|i [|m [|e [|f l]]]]| ]; try discriminate; steps E; steps E0;
    exists i, m; cbn; (split; [eapply below_reads; eassumption|]);
    (split; [apply number_of; assumption|]); [reflexivity|].
  exists e. split; [reflexivity|]. eapply vec_reads; eassumption.
Qed.
Lemma uses_read P : reads (uses_of P) (list_is use_is).
Proof. intros v us E. unfold uses_of in E. steps E. eapply list_reads; [apply use_reads|exact E0].
  Qed.
Lemma failure_reads P name v r : failure_of P name v = Fine r -> reason_is (Obj [(name, v)]) r.
Proof.
  unfold failure_of. intro E. destruct (String.eqb_spec name "goal") as [->|_].
  { steps E. exists v. split; [reflexivity|]. eapply uses_read; eassumption. }
  destruct (String.eqb_spec name "start") as [->|_].
  { steps E. exists v. split; [reflexivity|]. eapply multipliers_read; eassumption. }
  destruct (String.eqb_spec name "hit") as [->|_]; [|discriminate].
  steps E. exists v. split; [reflexivity|]. eapply hit_reads; eassumption.
Qed.
Lemma leaf_reads P name v r : leaf_of P name v = Fine r -> reason_is (Obj [(name, v)]) r.
Proof.
  unfold leaf_of. intro E. destruct (String.eqb_spec name "safe") as [->|_].
  { steps E. exists v. split; [reflexivity|]. eapply sep_reads; eassumption. }
  destruct (String.eqb_spec name "open") as [->|_].
  { apply fine_is in E. subst. exists v. reflexivity. }
  destruct (String.eqb_spec name "bounded") as [->|_]; [|apply failure_reads in E; exact E].
  destruct v as [ | | | | |[|[n w] [|m l]]]; try discriminate. steps E.
  eexists. split; [reflexivity|]. eapply failure_reads; eassumption.
Qed.
Lemma grown_is P nodes : forall made t, grown P nodes made = Fine t ->
  forall ls, Forall2 nodes_are ls made -> nodes_are (rev nodes ++ concat ls) t.
Proof.
  induction nodes as [|v nodes IH]; intros made t E ls F; cbn [grown] in E.
  - destruct F as [|l x ls made F G]; [discriminate|]. destruct G; [|discriminate].
    apply fine_is in E. subst. cbn. rewrite app_nil_r. exact F.
  - destruct v as [ | | | | |[|[name v] [|m l]]]; try discriminate.
    cbn [rev]. rewrite <- app_assoc. cbn [app].
    destruct (String.eqb_spec name "split") as [->|_].
    + destruct F as [|l1 lower ls made F1 F]; [destruct (pair_of _ _ v); discriminate|].
      destruct F as [|l2 upper ls made F2 F]; [destruct (pair_of _ _ v); discriminate|].
      destruct (pair_of _ _ v) as [[i x]|] eqn:X; [|discriminate].
      specialize (IH _ _ E ((Obj [("split", v)] :: l1 ++ l2)%list :: ls)).
      cbn [concat app] in IH. cbn [concat]. rewrite app_assoc. apply IH. constructor; [|exact F].
      apply split; auto. exact (pair_reads _ _ _ _ (below_reads _) number_reads _ _ X).
    + destruct (leaf_of P name v) as [r|] eqn:X; [|discriminate].
      apply (IH _ _ E ([Obj [(name, v)]] :: ls)). constructor; [|exact F].
      apply leaf, (leaf_reads P), X.
Qed.
Lemma tree_reads P : reads (tree_of P) (fun v t => exists vs, v = Arr vs /\ nodes_are vs t).
Proof.
  intros v t E. unfold tree_of in E. steps E. destruct v; try discriminate. apply fine_is in E0.
    subst.
  exists x. split; [reflexivity|]. pose proof (grown_is P _ _ _ E [] (Forall2_nil _)) as G.
  cbn [concat] in G. rewrite rev_append_rev, !app_nil_r, rev_involutive in G. exact G.
Qed.
Lemma proof_reads P kind v o p : object_is ["kind"; "z"; "faces"; "tree"] [] v o ->
  In ("kind", Str kind) o -> proof_of P o = Fine p -> proof_is kind v p.
Proof.
  intros O K E. unfold proof_of in E. steps E. exists o. cbn. split; [exact O|]. split; [exact K|].
  split; [eapply field_reads; [apply box_reads|eassumption]|]. split.
  - eapply field_reads; [|eassumption]. apply sized_reads, pair_reads; apply uses_read.
  - eapply field_reads; [|eassumption]. apply tree_reads.
Qed.
Lemma absence_reads P : reads (absence_of P) absence_is.
Proof.
  intros v x E. unfold absence_of in E. steps E. apply object_reads in E0.
  destruct (look "kind" x0) as [[ | | |kind| | ]|] eqn:K; try discriminate. apply look_in in K.
  destruct (String.eqb_spec kind "proved") as [->|_].
  { apply fine_is in E. subst. eapply proof_reads; eassumption. }
  destruct (String.eqb_spec kind "bracket") as [->|_]; [|discriminate].
  apply fine_is in E. subst. eapply proof_reads; eassumption.
Qed.

(* ---- A whole answer ---- *)
Lemma entries_read {A} name (f : json -> result A) is o l : reads f is -> entries name f o = Fine l
  ->
  entries_are name is o l.
Proof.
  intros R E. unfold entries in E. destruct (look name o) as [v|] eqn:K.
  - left. exists v. split; [apply look_in, K|]. refine (list_reads _ _ _ _ _ E). intros w x F.
    apply fine_is in F. subst. unfold tried. destruct (f w) as [y|] eqn:G; [apply R, G|exact I].
  - right. apply fine_is in E. subst. split; [apply look_none, K|reflexivity].
Qed.
Lemma answer_reads : reads answer_of answer_is.
Proof.
  intros v a E. unfold answer_of in E. steps E. apply object_reads in E0. apply check_is in E1.
  destruct (look "format" x) as [[ | | |s| | ]|] eqn:K; try discriminate.
  apply String.eqb_eq in E1. subst s. exists x. cbn. split; [exact E0|].
  split; [apply look_in, K|]. split; [eapply field_reads; [apply problem_reads|eassumption]|].
  split; [eapply field_reads; [apply network_reads|eassumption]|].
  split; [rewrite <- surjective_pairing; eapply field_reads; [apply tube_reads|eassumption]|].
  split; [eapply entries_read; [apply sample_reads|eassumption]|].
  split; [eapply entries_read; [apply piece_reads|eassumption]|].
  split; [eapply entries_read; [apply sample_reads|eassumption]|].
  split; [eapply entries_read; [apply boxed_reads|eassumption]|].
  eapply field_reads; [|eassumption]. intros w b F.
  assert (G : w = Null /\ b = Unclaimed \/ b = match absence_of x1 w with Fine y => y | Faulty _ =>
    Unread end)
    by (destruct w; apply fine_is in F; auto).
  destruct G as [(-> & ->) | ->]; [reflexivity|].
  destruct (absence_of x1 w) as [y|] eqn:Y; [apply (absence_reads x1), Y|exact I].
Qed.

(* ---- A whole episode ---- *)
Lemma poses_read n v p h : pose_of n v = Fine (p, h) ->
  vec_is v (p ++ match h with Some x => [x] | None => [] end)%list.
Proof.
  unfold pose_of. intro E. apply bind_is in E as (l & L & E). apply numbers_read in L.
  destruct (many l =? n)%nat.
  - apply fine_is in E. injection E as <- <-. rewrite app_nil_r. exact L.
  - destruct l as [|x [|y [|z [|w l]]]]; try discriminate. steps E. injection E as <- <-. exact L.
Qed.
Lemma ticks_read v P dt : problem_and_tick v = Fine (P, dt) ->
  problem_is v P /\ exists o, v = Obj o /\ field_is "dt" number_is o dt.
Proof.
  unfold problem_and_tick. intro E. apply bind_is in E as (Q & K & E). apply problem_reads in K.
  destruct v as [ | | | | |o]; try discriminate. apply bind_is in E as (t & T & E).
  apply fine_is in E. injection E as -> ->. split; [exact K|]. exists o. split; [reflexivity|].
  eapply field_reads; [exact number_reads|exact T].
Qed.
Lemma manoeuvre_reads P dt copies turns H :
  reads (manoeuvre_of P dt copies turns H) (manoeuvre_is dt turns H).
Proof.
  intros v m E. unfold manoeuvre_of in E. steps E. destruct x1 as (p, h), x2 as (Q, t). cbn in *.
  apply object_reads in E0. apply check_is, andb_prop in E4 as (_ & D). apply Qeq_bool_iff in D.
  apply check_is, eqb_prop in E5. exists x. cbn. split; [exact E0|].
  split; [eapply field_reads; [exact number_reads|exact E1]|]. split; [|split; [|split; [|split]]].
  - unfold field in E2. steps E2. eexists. split; [apply get_in; eassumption|].
    apply poses_read in E2. subst turns. destruct h; exact E2.
  - subst turns. destruct h; [discriminate|reflexivity].
  - unfold field in E3. steps E3. eexists. split; [apply get_in; eassumption|].
    apply ticks_read in E3 as (A & o & -> & w & I & W). split; [exact A|]. exists o.
    split; [reflexivity|]. exists w. split; [exact I|]. eapply number_is_eq; [exact W|].
    symmetry. exact D.
  - reflexivity.
  - eapply field_reads; [|eassumption]. intros w y F. apply fine_is in F. subst. unfold tried.
    destruct (sample_of Q w) as [z|] eqn:Z; [eapply sample_reads, Z|exact I].
Qed.
Lemma episode_reads : reads episode_of episode_is.
Proof.
  intros v e E. unfold episode_of in E. apply bind_is in E as (o & O & E).
  apply object_reads in O. apply bind_is in E as (u & F & E). apply check_is in F.
  destruct (look "format" o) as [[ | | |s| | ]|] eqn:K; try discriminate.
  apply String.eqb_eq in F. subst s. apply bind_is in E as (ms & M & E).
  destruct ms as [|m ms]; [discriminate|]. cbv zeta in E. steps E.
  exists o, (snd x2). eexists. cbn [its_net its_tube tick turning doubt done]. split; [exact O|].
    split; [apply look_in, K|].
  split; [eapply field_reads; [apply network_reads|eassumption]|].
  split; [rewrite <- surjective_pairing; eapply field_reads; [apply tube_reads|eassumption]|].
  assert (L : field_is "doubt" vec_is o x4 /\ length x4 = (n_p (fst x0) + 2)%nat).
  { unfold field in E5. steps E5. split; [eexists; split; [apply get_in; eassumption|]|].
    - eapply vec_reads; eassumption.
    - apply sized_list in E5. tauto. }
  destruct L as (L1 & L2).
  split; [rewrite (firstn_skipn (n_p (fst x0)) x4); exact L1|].
  split; [rewrite skipn_length; lia|].
  unfold field in M. apply bind_is in M as (y & Y & M). exists y. split; [apply get_in;
    assumption|].
  destruct y as [ | | | |l| ]; try discriminate. apply fine_is in M. subst l. exists (m :: ms).
  split; [reflexivity|]. match goal with F : each _ _ = _ |- _ => apply each_is in F;
    eapply Forall2_imp; [|exact F] end.
  intros w z F. eapply manoeuvre_reads, F.
Qed.
