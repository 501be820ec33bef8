(* How much an answer may ask for, so that a short file cannot ask for hours: products (long numbers count by their
   length) and tests for zero, of which there is one for each step of the checker's loops.  Only ever refuses. *)
exception Exceeded

let left = ref max_int
let spend n =
  left := !left - n;
  if !left < 0 then raise Exceeded

let mul a b =
  spend (1 + (Z.size a * Z.size b / 16));
  Z.mul a b

let equal a b =
  spend 1;
  Z.equal a b
