(* Stands for zarith's module of this name, as far as the extracted checker uses it. *)
type big_int = Z.t
let zero_big_int = Z.zero
let unit_big_int = Z.one
let big_int_of_int = Z.of_int
let int_of_big_int = Z.to_int
let add_big_int = Z.add
let sub_big_int = Z.sub
let mult_big_int = Z.mul
let mult_int_big_int i a = Z.mul (Z.of_int i) a
let minus_big_int = Z.neg
let abs_big_int = Z.abs
let succ_big_int a = Z.add a Z.one
let compare_big_int = Z.cmp
let eq_big_int a b = Z.cmp a b = 0
let le_big_int = Z.leq
let max_big_int a b = if Z.leq a b then b else a
let sign_big_int = Z.sign
let quomod_big_int a b = let q = Z.fdiv a b in (q, Z.sub a (Z.mul q b))
let add_int_big_int i a = Z.add (Z.of_int i) a
let pred_big_int a = Z.sub a Z.one
let div_big_int = Z.fdiv
let mod_big_int a b = snd (quomod_big_int a b)
let min_big_int a b = if Z.leq a b then a else b
let sqrt_big_int = Z.sqrt
let gcd_big_int = Z.gcd
