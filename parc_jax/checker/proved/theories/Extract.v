(* The checker as OCaml.  Indices become machine integers, numbers those of zarith. *)
From Coq Require Import ExtrOcamlBasic ExtrOcamlNatInt ExtrOcamlZBigInt ZArith QArith.
From ParcJax Require Import Spec Arithmetic Checker Doubt NoPlan Answer Episode ClaimSpec Claim.
(* Not trusted: greatest common divisors, quotients and roots are tried where they are used
   (Arithmetic.v, Claim.v; exactly in reader.ml). *)
Extract Constant Z.gcd => "Z.gcd".
Extract Constant Z.sqrt => "(fun z -> if Z.sign z < 0 then Z.zero else Z.sqrt z)".
Extract Constant Z.div => "(fun a b -> if Z.sign b = 0 then Z.zero else Z.fdiv a b)".
(* Trusted, with ExtrOcamlBasic, ExtrOcamlNatInt and ExtrOcamlZBigInt: *)
Extract Constant Z.leb => "Z.leq".
(* The same, and counts (work.ml): *)
Extract Constant Z.mul => "Work.mul".
Extract Constant Pos.mul => "Work.mul".
Extract Constant Z.eqb => "Work.equal".
(* The same, and says how far it is (work.ml): *)
Extract Constant told => "Work.told".
Extraction "program/check.ml" check_answer check_episode check_claim.
