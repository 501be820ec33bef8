(* check answer.json ...         exit code 0 proved, 1 rejected, 2 cannot be read
   check --each answer.json ...  for comparisons: a line of JSON for each file, with a digit for every entry
   check --read answer.json ...  the same with what was read, as terms of Coq; null where the file is refused *)
let read path =
  let file = open_in_bin path in
  let n = in_channel_length file in
  (* one byte more than the limit is enough to be refused for its size *)
  let s = really_input_string file (min n (Z.to_int Check.max_bytes + 1)) in
  close_in file;
  s

(* Most of what is made is soon forgotten. *)
let () = Gc.set { (Gc.get ()) with minor_heap_size = 1 lsl 20; space_overhead = 400 }

let () =
  match List.tl (Array.to_list Sys.argv) with
  | "--each" :: (_ :: _ as paths) -> List.iter (fun path -> print_endline (Verdict.to_json (Verdict.check_file (read path)))) paths
  | "--read" :: (_ :: _ as paths) ->
    List.iter (fun path ->
        print_endline (match Verdict.read (read path) with
          | answer, _, _ -> Terms.to_json answer
          | exception _ -> "null")) paths
  | [ path ] when path <> "" && path.[0] <> '-' -> begin
    match read path with
    | exception (Sys_error why) -> prerr_endline ("The file cannot be read: " ^ why); exit 2
    | source ->
      let v = Verdict.check_file source in
      List.iter print_endline v.lines;
      exit v.code
  end
  | _ -> prerr_endline "usage: check answer.json"; exit 2
