#include "interpolation_box.hpp"

#include <algorithm>
#include <cmath>

namespace gp_localize {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Nodes that bring 4 exp(growth b^2) rho^-(n-1) / (rho - 1) below `tolerance` for the best rho.
double order_for(double half_width, double growth, double tolerance) {
  double best = 1e9;
  for (double rho = 1.25; rho < 2000.0; rho *= 1.15) {
    const double b = 0.5 * half_width * (rho - 1.0 / rho);
    const double log_bound = std::log(4.0 / tolerance) + growth * b * b - std::log(rho - 1.0);
    best = std::min(best, 1.0 + std::max(0.0, log_bound) / std::log(rho));
  }
  return std::ceil(best);
}

}  // namespace

int chebyshev_order(double half_width, const InterpolationTolerance& tolerance) {
  // Interpolation in two axes: the error of the first, and that of the second times the Lebesgue
  // constant of the first, which is below 4 up to 100 nodes.
  constexpr double kShare = 0.2;
  const double order = std::max(order_for(half_width, 1.0, kShare * tolerance.mean),
                                order_for(half_width, 2.0, kShare * tolerance.variance));
  return static_cast<int>(std::min(order, 1e6));
}

bool InterpolationBox::fit(const field_core::Places& places, const field_core::Place& length_scales,
                           const InterpolationTolerance& tolerance, Eigen::Index most) {
  int orders[2];
  for (int i = 0; i < 2; ++i) {
    const double low = places.row(i).minCoeff(), high = places.row(i).maxCoeff();
    axes_[i].centre = 0.5 * (low + high);
    // A cloud of no width still needs distinct nodes.
    axes_[i].half_width = std::max(0.5 * (high - low), 1e-6 * length_scales[i]);
    orders[i] = chebyshev_order(axes_[i].half_width / length_scales[i], tolerance);
  }
  const Eigen::Index count = static_cast<Eigen::Index>(orders[0]) * orders[1];
  if (count > most) return false;
  for (int i = 0; i < 2; ++i) set_order(orders[i], axes_[i]);
  nodes_.reserve(2 * most);
  nodes_.clear();
  for (const double x : axes_[0].nodes) {
    for (const double y : axes_[1].nodes) {
      nodes_.push_back(axes_[0].centre + axes_[0].half_width * x);
      nodes_.push_back(axes_[1].centre + axes_[1].half_width * y);
    }
  }
  coefficients_.reserve(places.cols() * most);
  coefficients_.resize(places.cols() * count);
  for (Eigen::Index p = 0; p < places.cols(); ++p) {
    for (int i = 0; i < 2; ++i) evaluate(places(i, p), axes_[i]);
    double* out = coefficients_.data() + p;
    for (const double x : axes_[0].polynomials) {
      for (const double y : axes_[1].polynomials) {
        *out = x * y;
        out += places.cols();
      }
    }
  }
  return true;
}

bool InterpolationBox::fit_where_it_pays(const field_core::Kernel& kernel,
                                         const field_core::Places& places, double tolerance,
                                         double noise_variance, double prior_variance,
                                         double mean_norm, double pair) {
  if (tolerance == 0.0 || noise_variance == 0.0 || kernel.dimensions() != 2 ||
      kernel.type() != field_core::KernelType::squared_exponential) {
    return false;
  }
  // Evaluating the nodes and combining them must cost less than evaluating the places.
  const auto count = static_cast<double>(places.cols());
  const double worth = 0.75 * pair * count / (pair + 2.0 * count);
  const double share = noise_variance / prior_variance;
  return fit(places, kernel.length_scales(),
             {tolerance * std::sqrt(share) / std::max(1.0, mean_norm), tolerance * share},
             std::min<Eigen::Index>(kMostNodes, static_cast<Eigen::Index>(worth)));
}

/// Chebyshev points of the first kind and their barycentric weights (Berrut and Trefethen 2004,
/// eq. 5.3).
void InterpolationBox::set_order(int order, Axis& axis) {
  constexpr std::size_t kUsual = 64;
  for (auto* numbers : {&axis.nodes, &axis.weights, &axis.polynomials}) numbers->reserve(kUsual);
  axis.nodes.resize(order);
  axis.weights.resize(order);
  axis.polynomials.resize(order);
  for (int j = 0; j < order; ++j) {
    const double angle = (2 * j + 1) * kPi / (2 * order);
    axis.nodes[j] = std::cos(angle);
    axis.weights[j] = (j % 2 ? -1.0 : 1.0) * std::sin(angle);
  }
}

/// All Lagrange polynomials at one place (their eq. 4.2).
void InterpolationBox::evaluate(double place, Axis& axis) {
  const double x = (place - axis.centre) / axis.half_width;
  double sum = 0.0;
  for (std::size_t j = 0; j < axis.nodes.size(); ++j) {
    const double distance = x - axis.nodes[j];
    if (distance == 0.0) {
      std::fill(axis.polynomials.begin(), axis.polynomials.end(), 0.0);
      axis.polynomials[j] = 1.0;
      return;
    }
    axis.polynomials[j] = axis.weights[j] / distance;
    sum += axis.polynomials[j];
  }
  for (double& polynomial : axis.polynomials) polynomial /= sum;
}

}  // namespace gp_localize
