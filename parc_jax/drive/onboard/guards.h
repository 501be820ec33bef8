#include <float.h>
#include <stdint.h>

#if defined(__FAST_MATH__) || defined(_M_FP_FAST)
#error "compile without -ffast-math: margins rely on the rounding of float64"
#endif
#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__
#error "compile without -ffinite-math-only: what is not a number would be called safe"
#endif
#ifdef __ASSOCIATIVE_MATH__
#error "compile without -fassociative-math: margins rely on sums of the terms that are written"
#endif
#if !defined(FLT_EVAL_METHOD) || (FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 1)
#error "compile so that double is computed as double (-mfpmath=sse): margins rely on float64"
#endif
#if FLT_RADIX != 2 || DBL_MANT_DIG != 53 || DBL_MAX_EXP != 1024
#error "compile for IEEE's double of 64 bits: margins rely on the rounding of float64"
#endif
