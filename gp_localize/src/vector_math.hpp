// Short vectors of 32 bytes for the hot kernels, by GCC/Clang vector extensions, and the functions on
// them that the libraries do not give. Only for .cpp files that choose their instruction set per
// function (see GP_LOCALIZE_CLONES): everything here is inlined into them.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

// One binary for all machines: on x86-64 the marked functions exist twice, for AVX2 + FMA and for the
// baseline, and the loader picks (an ifunc). Other machines (ARM has NEON always) need one version.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define GP_LOCALIZE_CLONES __attribute__((target_clones("arch=haswell", "default")))
#else
#define GP_LOCALIZE_CLONES
#endif
#define GP_LOCALIZE_INLINE inline __attribute__((always_inline))

namespace gp_localize {

template <class T>
struct VectorTraits;
template <>
struct VectorTraits<float> {
  typedef float Vector __attribute__((vector_size(32)));
  typedef std::int32_t Bits __attribute__((vector_size(32)));
  using Int = std::int32_t;
  static constexpr int kLanes = 8, kMantissa = 23, kBias = 127, kExpTerms = 7, kLogTerms = 6;
  static constexpr float kRound = 0x1.8p23f, kSmallestExp = -87.0f;
};
template <>
struct VectorTraits<double> {
  typedef double Vector __attribute__((vector_size(32)));
  typedef std::int64_t Bits __attribute__((vector_size(32)));
  using Int = std::int64_t;
  static constexpr int kLanes = 4, kMantissa = 52, kBias = 1023, kExpTerms = 13, kLogTerms = 12;
  static constexpr double kRound = 0x1.8p52, kSmallestExp = -708.0;
};
template <class T>
using Vector = typename VectorTraits<T>::Vector;

template <class T>
GP_LOCALIZE_INLINE Vector<T> broadcast(T value) {
  return value - Vector<T>{};
}
template <class T>
GP_LOCALIZE_INLINE Vector<T> load(const T* from) {
  Vector<T> v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
template <class T>
GP_LOCALIZE_INLINE void store(T* to, Vector<T> v) {
  std::memcpy(to, &v, sizeof v);
}
template <class T>
GP_LOCALIZE_INLINE T sum(Vector<T> v) {
  T total = 0;
  for (int lane = 0; lane < VectorTraits<T>::kLanes; ++lane) total += v[lane];
  return total;
}

/// exp(x) for x <= 0, to 2 units in the last place; arguments below kSmallestExp give exp of that.
/// x = n ln 2 + r, |r| <= ln 2 / 2; Taylor's series of exp(r); n goes into the exponent bits.
template <class T>
GP_LOCALIZE_INLINE Vector<T> exp_of_negative(Vector<T> x) {
  using V = VectorTraits<T>;
  x = x < V::kSmallestExp ? broadcast<T>(V::kSmallestExp) : x;
  const Vector<T> rounded = x * T(1.4426950408889634) + V::kRound;  // n in the low mantissa bits
  const Vector<T> n = rounded - V::kRound;
  // ln 2 in two parts, the first with trailing zero bits, so that n times it is exact.
  constexpr T kLn2High = sizeof(T) == 4 ? T(0.693359375) : T(0.69314718036912381649);
  constexpr T kLn2Low = sizeof(T) == 4 ? T(-2.12194440054690583e-4) : T(1.90821492927058770e-10);
  const Vector<T> r = (x - n * kLn2High) - n * kLn2Low;
  Vector<T> series = broadcast<T>(1);
  for (int k = V::kExpTerms; k > 0; --k) series = series * r * (T(1) / T(k)) + T(1);
  const auto exponent = ((typename V::Bits)rounded + typename V::Int(V::kBias)) << V::kMantissa;
  return series * (Vector<T>)exponent;
}

/// log(x) for positive normal x. x = 2^e f, f in [sqrt(1/2), sqrt(2)); log f = 2 artanh((f-1)/(f+1)).
template <class T>
GP_LOCALIZE_INLINE Vector<T> log_of_positive(Vector<T> x) {
  using V = VectorTraits<T>;
  using Bits = typename V::Bits;
  using Int = typename V::Int;
  const Bits bits = (Bits)x;
  constexpr Int kMask = (Int(1) << V::kMantissa) - 1;
  Vector<T> f = (Vector<T>)((bits & kMask) | (Int(V::kBias) << V::kMantissa));
  const Bits high = f > T(1.4142135623730951);
  f = high ? f * T(0.5) : f;
  const Bits e = (bits >> V::kMantissa) - Int(V::kBias) - high;
  const Vector<T> exponent = (Vector<T>)(e + (Bits)broadcast<T>(V::kRound)) - V::kRound;
  const Vector<T> s = (f - T(1)) / (f + T(1));
  const Vector<T> s2 = s * s;
  Vector<T> series = broadcast<T>(0);
  for (int k = V::kLogTerms; k >= 0; --k) series = series * s2 + T(1) / T(2 * k + 1);
  return exponent * T(0.6931471805599453) + T(2) * s * series;
}

/// Square root of non-negative numbers; a loop that compilers turn into one instruction.
template <class T>
GP_LOCALIZE_INLINE Vector<T> square_root(Vector<T> x) {
  Vector<T> root;
  for (int lane = 0; lane < VectorTraits<T>::kLanes; ++lane) root[lane] = std::sqrt(x[lane]);
  return root;
}

}  // namespace gp_localize
