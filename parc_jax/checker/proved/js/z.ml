(* Stands for zarith's module of this name: JavaScript's big integers (stubs.js). *)
type t
external of_int : int -> t = "jz_of_int"
external add : t -> t -> t = "jz_add"
external sub : t -> t -> t = "jz_sub"
external mul : t -> t -> t = "jz_mul"
external neg : t -> t = "jz_neg"
external quo : t -> t -> t = "jz_quo"
external rem : t -> t -> t = "jz_rem"
external cmp : t -> t -> int = "jz_cmp"
external sqrt : t -> t = "jz_sqrt"
external gcd : t -> t -> t = "jz_gcd"
external shift_left : t -> int -> t = "jz_shl"
external base : int -> string -> t = "jz_base"
external size : t -> int = "jz_size"
external to_string : t -> string = "jz_text"
external to_int : t -> int = "jz_to_int"
let equal a b = cmp a b = 0
let zero = of_int 0
let one = of_int 1
let sign a = cmp a zero
let abs a = if sign a < 0 then neg a else a
let leq a b = cmp a b <= 0
let fdiv a b = let q = quo a b in let r = rem a b in if sign r <> 0 && (sign r < 0) <> (sign b < 0) then sub q one else q
let divexact = quo
let of_string s = base 10 s
let of_string_base b s = base b s
let rec pow a n =
  if n = 0 then one else let h = pow a (n / 2) in let s = mul h h in if n land 1 = 1 then mul a s else s
