// What z.ml needs, on JavaScript's own big integers.
//Provides: jz_of_int
function jz_of_int(a){return BigInt(a)}
//Provides: jz_to_int
function jz_to_int(a){return Number(a)}
//Provides: jz_long
var jz_long=BigInt(1)<<BigInt(512)
// In words of 64 bits; up to eight count as one, since the length of a big integer is not to be had quickly.
//Provides: jz_size
//Requires: jz_long
function jz_size(a){return a<jz_long&&a>-jz_long?1:a.toString(16).length>>4}
//Provides: jz_add
function jz_add(a,b){return a+b}
//Provides: jz_sub
function jz_sub(a,b){return a-b}
//Provides: jz_mul
function jz_mul(a,b){return a*b}
//Provides: jz_neg
function jz_neg(a){return -a}
//Provides: jz_quo
function jz_quo(a,b){return a/b}
//Provides: jz_rem
function jz_rem(a,b){return a%b}
//Provides: jz_cmp
function jz_cmp(a,b){return a<b?-1:a>b?1:0}
//Provides: jz_gcd
function jz_gcd(a,b){
  // Lehmer's: the quotients of the leading 52 bits serve many steps of Euclid's at once (whoever asks tries the result)
  var z=BigInt(0),most=BigInt(9007199254740991),shift=-1,t;
  if(a<z)a=-a;
  if(b<z)b=-b;
  if(a<b){t=a;a=b;b=t}
  while(b>most){
    if(shift<0)shift=a.toString(16).length*4-52;
    var x=Number(a>>BigInt(shift));
    if(x===0){shift=-1;continue}
    var bits=Math.floor(Math.log2(x))+1;
    if(bits<44){shift=Math.max(0,shift+bits-52);x=Number(a>>BigInt(shift))}
    var y=Number(b>>BigInt(shift)),A=1,B=0,C=0,D=1;
    while(y+C!==0&&y+D!==0){
      var q=Math.floor((x+A)/(y+C));
      if(q!==Math.floor((x+B)/(y+D)))break;
      t=A-q*C;A=C;C=t;t=B-q*D;B=D;D=t;t=x-q*y;x=y;y=t
    }
    if(B===0){t=a%b;a=b;b=t}
    else{t=BigInt(A)*a+BigInt(B)*b;b=BigInt(C)*a+BigInt(D)*b;a=t}
  }
  if(b===z)return a;
  t=Number(a%b);var s=Number(b);
  while(t!==0){var r=s%t;s=t;t=r}
  return BigInt(s)
}
//Provides: jz_sqrt
function jz_sqrt(a){if(a<BigInt(2))return a;var x=BigInt(1)<<BigInt((a.toString(2).length+1)>>1);for(;;){var y=(x+a/x)>>BigInt(1);if(y>=x)return x;x=y}}
//Provides: jz_shl
function jz_shl(a,n){return a<<BigInt(n)}
//Provides: jz_text
//Requires: caml_string_of_jsstring
function jz_text(a){return caml_string_of_jsstring(a.toString())}
//Provides: jz_base
//Requires: caml_jsstring_of_string
function jz_base(b,s){s=caml_jsstring_of_string(s);return BigInt((b===16?"0x":"")+s)}
// parcCheck(text, progress) -> {code, lines, entries}; progress(kind, done, total) is called after each entry. Bytes of a
// file are given as they are (Uint8Array): decoded before, those that are no UTF-8 would be replaced.
//Provides: jz_export
//Requires: caml_string_of_jsstring, caml_jsstring_of_string, caml_string_of_array
function jz_export(f){
  globalThis.parcCheck=function(text,progress){
    var tell=progress?function(k,i,n){progress(caml_jsstring_of_string(k),i,n);return 0}:function(k,i,n){return 0};
    var bytes=typeof text==="string"?caml_string_of_jsstring(text):caml_string_of_array(text);
    return JSON.parse(caml_jsstring_of_string(f(bytes,tell)))
  }
}
