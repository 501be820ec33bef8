(* The checker as OCaml.  Indices become machine integers, numbers those of zarith. *)
From Coq Require Import ExtrOcamlBasic ExtrOcamlNatInt ExtrOcamlZBigInt ExtrOcamlNativeString.
From Coq Require Import Ascii String ZArith QArith.
From ParcJax Require Import Spec Arithmetic Integers Checker Polytopes Doubt NoPlan Answer Episode
  ClaimSpec Claim Json Parse Reader.
(* Not trusted: greatest common divisors, quotients and roots are tried where they are used
   (Arithmetic.v, Claim.v, Reader.v). *)
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
(* Not trusted either: any bits of a key do. *)
Extract Constant bit => "(fun i s -> (Hashtbl.hash s lsr i) land 1 = 1)".
(* Bytes, which are OCaml's: trusted, with ExtrOcamlNativeString. *)
Extract Constant String.length => "String.length".
Extract Constant String.get =>
  "(fun i s -> if i < String.length s then Some (String.unsafe_get s i) else None)".
Extract Constant String.substring =>
  "(fun i n s -> let l = String.length s in
     if i >= l then """" else String.sub s i (Stdlib.min n (l - i)))".
Extract Constant within => "(fun (lo : char) hi c -> lo <= c && c <= hi)".
Extract Constant ascii_of_N => "(fun n -> Char.chr (Big_int_Z.int_of_big_int n land 255))".
Extract Constant N_of_ascii => "(fun c -> Big_int_Z.big_int_of_int (Char.code c))".
Extract Constant nat_of_ascii => "Char.code".
Extract Constant Z.of_nat => "Big_int_Z.big_int_of_int".
Extract Constant N.of_nat => "Big_int_Z.big_int_of_int".
Extract Constant N.to_nat => "Big_int_Z.int_of_big_int".
Extract Constant Nat.sub => "(fun (a : int) b -> if a < b then 0 else a - b)".
Extraction "program/check.ml" check_answer check_episode check_claim parse max_bytes
  answer_of episode_of number fraction.
