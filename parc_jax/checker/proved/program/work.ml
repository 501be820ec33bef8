(* How much an answer may ask for, so that a short file cannot ask for hours: products (long numbers count by their
   length) and tests for zero, of which there is one for each step of the checker's loops.  Only ever refuses. *)
exception Exceeded

(* A float, exact up to 2^53: a whole number has 32 bits in JavaScript, and two megabytes of file ask for more. *)
type allowance = { mutable left : float }

let allowance = { left = infinity }
let allow most = allowance.left <- most
let spend n =
  allowance.left <- allowance.left -. float_of_int n;
  if allowance.left < 0. then raise Exceeded

let mul a b =
  spend (1 + (Z.size a * Z.size b / 16));
  Z.mul a b

(* Called after each entry. *)
let on_told = ref (fun () -> ())

let told ok =
  !on_told ();
  ok

let equal a b =
  spend 1;
  Z.equal a b
