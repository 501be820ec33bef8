(* Hands the checker to JavaScript (stubs.js says how). *)
external export : (string -> (string -> int -> int -> unit) -> string) -> unit = "jz_export"

let () = export (fun source progress -> Verdict.to_json (Verdict.check_file ~progress source))
