(* IEEE 754's binary64, rounded to nearest, with infinities and NaN, as Flocq has it: an arithmetic
   as the theorem asks for one. *)
From Coq Require Import ZArith Reals Lra Bool.
From Flocq Require Import Core BinarySingleNaN Relative.
From ParcJax.Onboard Require Import Arithmetic.
Open Scope R_scope.

Definition double := binary_float 53 1024.

#[local] Instance precision : Prec_gt_0 53 := eq_refl.
#[local] Instance exponents : Prec_lt_emax 53 1024 := eq_refl.

Definition rounded (x : R) : R := round radix2 (SpecFloat.fexp 53 1024) (round_mode mode_NE) x.

Lemma power n : bpow radix2 (Z.of_nat n) = 2 ^ n.
Proof. rewrite bpow_powerRZ, <- pow_powerRZ. reflexivity. Qed.

Transparent u eta largest.

Lemma u_is : / 2 * bpow radix2 (-53 + 1) = u.
Proof.
  change (-53 + 1)%Z with (- Z.of_nat 52)%Z. rewrite bpow_opp, power. unfold u.
  replace (2 ^ 53) with (2 * 2 ^ 52) by reflexivity. field.
Qed.

Lemma below_eta : / 2 * bpow radix2 (3 - 1024 - 53) <= eta.
Proof.
  assert (H : bpow radix2 (3 - 1024 - 53) <= bpow radix2 (- Z.of_nat 1022)).
  { apply bpow_le. vm_compute. discriminate. }
  rewrite bpow_opp, power in H. fold eta in H. pose proof eta_pos. lra.
Qed.

Lemma largest_is : largest = bpow radix2 1023.
Proof. symmetry. exact (power 1023). Qed.

Opaque u eta largest.

Lemma rounded_near x : near x (rounded x).
Proof.
  destruct (error_N_FLT radix2 (3 - 1024 - 53) 53 eq_refl (fun z => negb (Z.even z)) x)
    as [eps [e [He [Ht [_ Hx]]]]].
  unfold near. change (rounded x) with
    (round radix2 (FLT_exp (3 - 1024 - 53) 53) (Znearest (fun z => negb (Z.even z))) x).
  rewrite Hx. replace (x * (1 + eps) + e - x) with (eps * x + e) by ring.
  eapply Rle_trans; [apply Rabs_triang|]. rewrite Rabs_mult.
  pose proof u_is. pose proof below_eta. apply Rplus_le_compat; [|lra].
  apply Rmult_le_compat_r; [apply Rabs_pos|]. simpl in *. lra.
Qed.

Lemma rounded_fits x : Rabs x <= largest ->
  Rlt_bool (Rabs (rounded x)) (bpow radix2 1024) = true.
Proof.
  intros H. apply Rlt_bool_true. rewrite largest_is in H.
  apply Rle_lt_trans with (bpow radix2 1023); [|apply bpow_lt; reflexivity].
  unfold rounded. apply abs_round_le_generic; [typeclasses eauto|typeclasses eauto| |exact H].
  apply generic_format_bpow. vm_compute. discriminate.
Qed.

(* What lies between two finite numbers is neither NaN nor infinite. *)
Lemma finite_between (lo x hi : double) : is_finite lo = true -> is_finite hi = true ->
  Bleb lo x = true -> Bleb x hi = true -> is_finite x = true.
Proof.
  destruct x as [s|s| |s m e H]; auto.
  destruct s; intros Hl Hh A B; exfalso.
  - destruct lo as [[]|[]| |[] ? ? ?]; discriminate.
  - destruct hi as [[]|[]| |[] ? ? ?]; discriminate.
Qed.

#[local] Obligation Tactic := cbv beta.

Program Definition binary64 : arithmetic := {|
  number := double;
  value := B2R;
  finite := fun x => is_finite x = true;
  zero := B754_zero false;
  negated := Bopp;
  at_most := Bleb;
  less := Bltb;
  sum := fun x y z => z = Bplus mode_NE x y;
  product := fun x y z => z = Bmult mode_NE x y;
  fused := fun x y s z => z = Bfma mode_NE x y s
|}.
Next Obligation. split; reflexivity. Qed.
Next Obligation. intros x Fx. split; [rewrite is_finite_Bopp; exact Fx|apply B2R_Bopp]. Qed.
Next Obligation.
  intros x y Fx Fy. rewrite Bleb_correct by assumption.
  case Rle_bool_spec; intros Order; split; intros Other; auto; try discriminate; lra.
Qed.
Next Obligation.
  intros x y Fx Fy. rewrite Bltb_correct by assumption.
  case Rlt_bool_spec; intros Order; split; intros Other; auto; try discriminate; lra.
Qed.
Next Obligation. intros lo x hi Flo Fhi Lo Hi. exact (finite_between lo x hi Flo Fhi Lo Hi). Qed.
Next Obligation.
  intros x y z Fx Fy Fits ->.
  pose proof (Bplus_correct 53 1024 _ _ mode_NE x y Fx Fy) as C.
  fold (rounded (B2R x + B2R y)) in C. rewrite (rounded_fits _ Fits) in C.
  destruct C as [V [Fin _]]. rewrite V. split; [exact Fin|apply rounded_near].
Qed.
Next Obligation.
  intros x y z Fx Fy Fits ->.
  pose proof (Bmult_correct 53 1024 _ _ mode_NE x y) as C.
  fold (rounded (B2R x * B2R y)) in C. rewrite (rounded_fits _ Fits) in C.
  destruct C as [V [Fin _]]. rewrite V, Fin, Fx, Fy. split; [reflexivity|apply rounded_near].
Qed.
Next Obligation.
  intros x y s z Fx Fy Fs Fits ->.
  pose proof (Bfma_correct 53 1024 _ _ mode_NE x y s Fx Fy Fs) as C. cbv zeta in C.
  fold (rounded (B2R x * B2R y + B2R s)) in C. rewrite (rounded_fits _ Fits) in C.
  destruct C as [V [Fin _]]. rewrite V. split; [exact Fin|apply rounded_near].
Qed.
