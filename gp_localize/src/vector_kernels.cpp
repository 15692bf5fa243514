#include "vector_kernels.hpp"

#include <algorithm>
#include <cmath>

#include "instruction_sets.hpp"
#include "vector_math.hpp"

namespace gp_localize {
namespace {

bool wide_vectors_supported() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#else
  return false;
#endif
}

bool use_wide = wide_vectors_supported();

template <class T, int Bytes>
struct Kernels {
  using M = VectorMath<T, Bytes>;
  using Vector = typename M::Vector;
  static constexpr int kLanes = M::kLanes;
  static constexpr int kParts = 2;
  static constexpr int kWidth = kParts * kLanes;  // points at a time

  static GP_LOCALIZE_INLINE void whitened_features(const WhitenedSupport& b, int n,
                                                   const double* points, int stride,
                                                   double* features) {
    alignas(64) T column[kMaxSupport][kWidth];
    for (int begin = 0; begin < n; begin += kWidth) {
      const int count = std::min(kWidth, n - begin);
      alignas(64) T at[field_core::kMostDimensions][kWidth];
      for (int l = 0; l < kWidth; ++l) {
        const double* p = points + static_cast<long>(begin + std::min(l, count - 1)) * stride;
        for (int axis = 0; axis < b.dimensions; ++axis) at[axis][l] = p[axis];
      }
      for (int i = 0; i < b.size; ++i) {
        const double* support = b.support + static_cast<long>(i) * b.dimensions;
        for (int h = 0; h < kWidth; h += kLanes) {
          const Vector r2 =
              squared_distance<M>(b.dimensions, [&](int axis) GP_LOCALIZE_INLINE_LAMBDA {
                return (M::load(&at[axis][h]) - support[axis]) / b.length_scales[axis];
              });
          M::store(&column[i][h], b.signal_variance * correlation<M>(b.kernel, r2));
        }
      }
      for (int i = b.size - 1; i >= 0; --i) {
        const T* w = b.whitening + static_cast<long>(i) * b.size;
        Vector sums[kParts]{};
        for (int k = 0; k <= i; ++k) {
          for (int h = 0; h < kParts; ++h) sums[h] += w[k] * M::load(&column[k][h * kLanes]);
        }
        alignas(64) T row[kWidth];
        for (int h = 0; h < kParts; ++h) M::store(row + h * kLanes, sums[h]);
        std::copy(row, row + count, features + static_cast<long>(i) * n + begin);
      }
    }
  }

  static GP_LOCALIZE_INLINE void log_mean_exp(const T* rows, int count, int hypotheses, int stride,
                                              double* out) {
    for (int p = 0; p < count; ++p, rows += stride) {
      const T largest = *std::max_element(rows, rows + hypotheses);
      Vector sums{};
      int c = 0;
      for (; c + kLanes <= hypotheses; c += kLanes) {
        sums += M::exp_of_negative(M::load(rows + c) - largest);
      }
      double total = M::sum(sums);
      for (; c < hypotheses; ++c) total += std::exp(static_cast<double>(rows[c] - largest));
      out[p] = static_cast<double>(largest) + std::log(total / hypotheses);
    }
  }
};

}  // namespace

bool use_wide_vectors(bool wanted) { return use_wide = wanted && wide_vectors_supported(); }
bool wide_vectors() { return use_wide; }

GP_LOCALIZE_KERNEL(whitened_features, double,
                   (const WhitenedSupport& basis, int n, const double* points, int stride,
                    double* features),
                   (basis, n, points, stride, features))
GP_LOCALIZE_KERNEL(log_mean_exp, float,
                   (const float* rows, int count, int hypotheses, int stride, double* out),
                   (rows, count, hypotheses, stride, out))
GP_LOCALIZE_KERNEL(log_mean_exp, double,
                   (const double* rows, int count, int hypotheses, int stride, double* out),
                   (rows, count, hypotheses, stride, out))

}  // namespace gp_localize
