// One binary for all machines: on x86-64 each hot kernel is compiled twice, for AVX2 with FMA
// (x86-64-v3) and for the baseline, and a flag read once from the processor chooses. Elsewhere one
// version, with the vectors that every machine of that kind has (NEON on 64-bit ARM). Results
// differ between the versions in the last bits only, but they differ: the same bits need the same
// kind of processor.
#pragma once

namespace gp_localize {

#if defined(__x86_64__)
#define GP_LOCALIZE_WIDE __attribute__((target("avx2,fma")))
constexpr int kWideBytes = 32;
#else
#define GP_LOCALIZE_WIDE
constexpr int kWideBytes = 16;
#endif

/// Whether AVX2 versions are used where the processor has them (the default); returns what is used
/// from now on. For tests and benchmarks.
bool use_wide_vectors(bool wanted);
bool wide_vectors();

/// Defines the function `name` from Kernels<T, Bytes>::name, which is inlined into both versions.
#define GP_LOCALIZE_KERNEL(name, T, parameters, arguments)                                 \
  namespace {                                                                              \
  GP_LOCALIZE_WIDE void name##_wide parameters { Kernels<T, kWideBytes>::name arguments; } \
  void name##_narrow parameters { Kernels<T, 16>::name arguments; }                        \
  }                                                                                        \
  void name parameters {                                                                   \
    if (wide_vectors()) {                                                                  \
      name##_wide arguments;                                                               \
    } else {                                                                               \
      name##_narrow arguments;                                                             \
    }                                                                                      \
  }

}  // namespace gp_localize
