// Short vectors for the hot kernels, by GCC/Clang vector extensions, and the functions on them that
// libraries do not give. Everything is inlined into functions that choose their instruction set
// (instruction_sets.hpp).
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "field_core/kernels.hpp"

#define GP_LOCALIZE_INLINE inline __attribute__((always_inline))
// Of a lambda, after its parameters.
#define GP_LOCALIZE_INLINE_LAMBDA __attribute__((always_inline))

namespace gp_localize {

template <class T>
struct FloatTraits;
template <>
struct FloatTraits<float> {
  using Int = std::int32_t;
  static constexpr int kMantissa = 23, kBias = 127, kExpTerms = 7, kLogTerms = 6;
  static constexpr float kRound = 0x1.8p23f, kSmallestExp = -87.0f;
  // ln 2 in two parts, the first with trailing zero bits, so that an integer times it is exact.
  static constexpr float kLn2High = 0.693359375f, kLn2Low = -2.12194440054690583e-4f;
};
template <>
struct FloatTraits<double> {
  using Int = std::int64_t;
  static constexpr int kMantissa = 52, kBias = 1023, kExpTerms = 13, kLogTerms = 12;
  static constexpr double kRound = 0x1.8p52, kSmallestExp = -708.0;
  static constexpr double kLn2High = 0.69314718036912381649, kLn2Low = 1.90821492927058770e-10;
};

/// Functions on vectors of `Bytes` bytes: 32 where AVX2 may be used, 16 everywhere else (a vector
/// wider than the registers would be taken apart, number by number).
template <class T, int Bytes>
struct VectorMath {
  using Number = T;
  using Traits = FloatTraits<T>;
  using Int = typename Traits::Int;
  typedef T Vector __attribute__((vector_size(Bytes)));
  typedef Int Bits __attribute__((vector_size(Bytes)));
  static constexpr int kLanes = Bytes / sizeof(T);

  struct InverseFactorials {
    T of[Traits::kExpTerms + 1]{};
    constexpr InverseFactorials() {
      double factorial = 1.0;
      for (int k = 0; k <= Traits::kExpTerms; factorial *= ++k) of[k] = T(1.0 / factorial);
    }
  };
  static constexpr InverseFactorials kInverseFactorial{};

  static GP_LOCALIZE_INLINE Vector broadcast(T value) { return value - Vector{}; }
  static GP_LOCALIZE_INLINE Vector load(const T* from) {
    Vector v;
    std::memcpy(&v, from, sizeof v);
    return v;
  }
  static GP_LOCALIZE_INLINE void store(T* to, Vector v) { std::memcpy(to, &v, sizeof v); }
  static GP_LOCALIZE_INLINE T sum(Vector v) {
    T total = 0;
    for (int lane = 0; lane < kLanes; ++lane) total += v[lane];
    return total;
  }

  /// exp(x) for x <= 0, to 2 units in the last place; arguments below kSmallestExp give exp of
  /// that. x = n ln 2 + r, |r| <= ln 2 / 2; Taylor's series of exp(r); n goes into the exponent
  /// bits.
  static GP_LOCALIZE_INLINE Vector exp_of_negative(Vector x) {
    x = x < Traits::kSmallestExp ? broadcast(Traits::kSmallestExp) : x;
    const Vector rounded =
        x * T(1.4426950408889634) + Traits::kRound;  // n in the low mantissa bits
    const Vector n = rounded - Traits::kRound;
    const Vector r = (x - n * Traits::kLn2High) - n * Traits::kLn2Low;
    Vector series = broadcast(kInverseFactorial.of[Traits::kExpTerms]);
#pragma GCC unroll 16
    for (int k = Traits::kExpTerms; k > 0; --k) series = series * r + kInverseFactorial.of[k - 1];
    const Bits exponent = ((Bits)rounded + Int(Traits::kBias)) << Traits::kMantissa;
    return series * (Vector)exponent;
  }

  /// log(x), x positive and normal. x = 2^e f, f in [sqrt(1/2), sqrt(2)); log f = 2
  /// artanh((f-1)/(f+1)).
  static GP_LOCALIZE_INLINE Vector log_of_positive(Vector x) {
    const Bits bits = (Bits)x;
    constexpr Int kMask = (Int(1) << Traits::kMantissa) - 1;
    Vector f = (Vector)((bits & kMask) | (Int(Traits::kBias) << Traits::kMantissa));
    const Bits high = f > T(1.4142135623730951);
    f = high ? f * T(0.5) : f;
    const Bits e = (bits >> Traits::kMantissa) - Int(Traits::kBias) - high;
    const Vector exponent = (Vector)(e + (Bits)broadcast(Traits::kRound)) - Traits::kRound;
    const Vector s = (f - T(1)) / (f + T(1));
    const Vector s2 = s * s;
    Vector series = Vector{};
#pragma GCC unroll 16
    for (int k = Traits::kLogTerms; k >= 0; --k) series = series * s2 + T(1) / T(2 * k + 1);
    return exponent * T(0.6931471805599453) + T(2) * s * series;
  }

  /// Square root of non-negative numbers; a loop that compilers turn into one instruction.
  static GP_LOCALIZE_INLINE Vector square_root(Vector x) {
    Vector root{};
    for (int lane = 0; lane < kLanes; ++lane) root[lane] = std::sqrt(x[lane]);
    return root;
  }
};

/// Sum of the squares of difference(0) ... difference(dimensions - 1); the plane without a loop.
template <class M, class Difference>
GP_LOCALIZE_INLINE typename M::Vector squared_distance(int dimensions, Difference difference) {
  using Vector = typename M::Vector;
  const Vector last = difference(dimensions - 1);
  Vector sum = last * last;
  if (dimensions == 2) {
    const Vector first = difference(0);
    return first * first + sum;
  }
  for (int axis = dimensions - 2; axis >= 0; --axis) {
    const Vector next = difference(axis);
    sum += next * next;
  }
  return sum;
}

/// field_core::correlation() on vectors of squared distances in length scales.
template <class M>
GP_LOCALIZE_INLINE typename M::Vector correlation(field_core::KernelType type,
                                                  typename M::Vector r2) {
  using field_core::KernelType;
  using T = typename M::Number;
  using Vector = typename M::Vector;
  if (type == KernelType::squared_exponential) return M::exp_of_negative(r2 * T(-0.5));
  const bool smooth = type == KernelType::matern52;
  const Vector r = M::square_root(r2 * (smooth ? T(5) : T(3)));
  const Vector decay = M::exp_of_negative(-r);
  return smooth ? (T(1) + r + r * r * T(1.0 / 3.0)) * decay : (T(1) + r) * decay;
}

}  // namespace gp_localize
