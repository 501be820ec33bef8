(* SHA-256 (FIPS 180-4), on Int32 so that it is the same in machine code and in JavaScript.  Not proved. *)
let k = [|
  0x428a2f98l; 0x71374491l; 0xb5c0fbcfl; 0xe9b5dba5l; 0x3956c25bl; 0x59f111f1l; 0x923f82a4l; 0xab1c5ed5l;
  0xd807aa98l; 0x12835b01l; 0x243185bel; 0x550c7dc3l; 0x72be5d74l; 0x80deb1fel; 0x9bdc06a7l; 0xc19bf174l;
  0xe49b69c1l; 0xefbe4786l; 0x0fc19dc6l; 0x240ca1ccl; 0x2de92c6fl; 0x4a7484aal; 0x5cb0a9dcl; 0x76f988dal;
  0x983e5152l; 0xa831c66dl; 0xb00327c8l; 0xbf597fc7l; 0xc6e00bf3l; 0xd5a79147l; 0x06ca6351l; 0x14292967l;
  0x27b70a85l; 0x2e1b2138l; 0x4d2c6dfcl; 0x53380d13l; 0x650a7354l; 0x766a0abbl; 0x81c2c92el; 0x92722c85l;
  0xa2bfe8a1l; 0xa81a664bl; 0xc24b8b70l; 0xc76c51a3l; 0xd192e819l; 0xd6990624l; 0xf40e3585l; 0x106aa070l;
  0x19a4c116l; 0x1e376c08l; 0x2748774cl; 0x34b0bcb5l; 0x391c0cb3l; 0x4ed8aa4al; 0x5b9cca4fl; 0x682e6ff3l;
  0x748f82eel; 0x78a5636fl; 0x84c87814l; 0x8cc70208l; 0x90befffal; 0xa4506cebl; 0xbef9a3f7l; 0xc67178f2l |]

let hex (s : string) : string =
  let open Int32 in
  let ( +% ) = add and ( ^% ) = logxor and ( &% ) = logand in
  let rotate x n = logor (shift_right_logical x n) (shift_left x (32 - n)) in
  let len = String.length s in
  let blocks = ((len + 8) / 64) + 1 in
  let byte j =
    if j < len then Char.code s.[j]
    else if j = len then 0x80
    else
      let place = (blocks * 64) - 1 - j in
      (* the last bytes are the length in bits, below 2^32 since a text has at most 2^26 bytes *)
      if place < 4 then ((len lsl 3) lsr (8 * place)) land 255 else 0 in
  let h = [| 0x6a09e667l; 0xbb67ae85l; 0x3c6ef372l; 0xa54ff53al; 0x510e527fl; 0x9b05688cl; 0x1f83d9abl; 0x5be0cd19l |] in
  let w = Array.make 64 0l in
  for block = 0 to blocks - 1 do
    for j = 0 to 15 do
      let at = (block * 64) + (4 * j) in
      let part o shift = shift_left (of_int (byte (at + o))) shift in
      w.(j) <- logor (logor (part 0 24) (part 1 16)) (logor (part 2 8) (part 3 0))
    done;
    for j = 16 to 63 do
      let a = w.(j - 15) and b = w.(j - 2) in
      let s0 = rotate a 7 ^% rotate a 18 ^% shift_right_logical a 3 in
      let s1 = rotate b 17 ^% rotate b 19 ^% shift_right_logical b 10 in
      w.(j) <- w.(j - 16) +% s0 +% w.(j - 7) +% s1
    done;
    let v = Array.copy h in
    for j = 0 to 63 do
      let e = v.(4) and a = v.(0) in
      let s1 = rotate e 6 ^% rotate e 11 ^% rotate e 25 in
      let choice = (e &% v.(5)) ^% (lognot e &% v.(6)) in
      let t1 = v.(7) +% s1 +% choice +% k.(j) +% w.(j) in
      let s0 = rotate a 2 ^% rotate a 13 ^% rotate a 22 in
      let majority = (a &% v.(1)) ^% (a &% v.(2)) ^% (v.(1) &% v.(2)) in
      Array.blit v 0 v 1 7;
      v.(4) <- v.(4) +% t1;
      v.(0) <- t1 +% s0 +% majority
    done;
    Array.iteri (fun j x -> h.(j) <- h.(j) +% x) v
  done;
  String.concat "" (Array.to_list (Array.map (Printf.sprintf "%08lx") h))
