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
function jz_gcd(a,b){var z=BigInt(0);if(a<z)a=-a;if(b<z)b=-b;while(b!==z){var t=a%b;a=b;b=t}return a}
//Provides: jz_sqrt
function jz_sqrt(a){if(a<BigInt(2))return a;var x=BigInt(1)<<BigInt((a.toString(2).length+1)>>1);for(;;){var y=(x+a/x)>>BigInt(1);if(y>=x)return x;x=y}}
//Provides: jz_shl
function jz_shl(a,n){return a<<BigInt(n)}
//Provides: jz_base
//Requires: caml_jsstring_of_string
function jz_base(b,s){s=caml_jsstring_of_string(s);return BigInt((b===16?"0x":"")+s)}
// parcCheck(text, progress) -> {code, lines, entries}; progress(kind, done, total) is called after each entry.
//Provides: jz_export
//Requires: caml_string_of_jsstring, caml_jsstring_of_string
function jz_export(f){
  globalThis.parcCheck=function(text,progress){
    var tell=progress?function(k,i,n){progress(caml_jsstring_of_string(k),i,n);return 0}:function(k,i,n){return 0};
    return JSON.parse(caml_jsstring_of_string(f(caml_string_of_jsstring(text),tell)))
  }
}
