#include "gp_localize/dense_gp.hpp"

#include <algorithm>
#include <cmath>

#include "field_core/errors.hpp"

namespace gp_localize {

std::vector<int> select_subset(ObservationModelType model, int count, int size) {
  const int n = model == ObservationModelType::full_gp ? count : std::min(count, size);
  std::vector<int> chosen(n);
  for (int i = 0; i < n; ++i) {
    switch (model) {
      case ObservationModelType::full_gp:
        chosen[i] = i;
        break;
      case ObservationModelType::sod_truncate:
        chosen[i] = count - n + i;
        break;
      case ObservationModelType::sod_even:
        chosen[i] =
            n == 1 ? count - 1 : static_cast<int>(std::lround(i * (count - 1.0) / (n - 1.0)));
        break;
      default:
        throw field_core::ParameterError("observation_model", "is no subset of the data");
    }
  }
  return chosen;
}

void DenseGp::append(const field_core::Kernel& kernel, const field_core::Place& place, double value,
                     double noise_variance) {
  data_.push_back({place, value, noise_variance});
  std::vector<int> next = select_subset(model_, static_cast<int>(data_.size()), subset_size_);
  const bool grows =
      next.size() == used_.size() + 1 && std::equal(used_.begin(), used_.end(), next.begin());
  used_.swap(next);
  if (grows) {
    append_row(kernel);
  } else {
    refactorize(kernel);
  }
}

void DenseGp::append_row(const field_core::Kernel& kernel) {
  const auto n = static_cast<Eigen::Index>(used_.size()) - 1;
  if (factor_.rows() <= n) {  // capacity doubles, as std::vector's
    const Eigen::Index capacity = std::max<Eigen::Index>(16, 2 * (n + 1));
    factor_.conservativeResize(capacity, capacity);
    places_.conservativeResize(kernel.dimensions(), capacity);
    whitened_.conservativeResize(capacity);
  }
  const Measured& d = data_[used_.back()];
  places_.col(n) = d.place;
  double pivot = kernel.signal_variance() + d.noise_variance, value = d.value;
  if (n > 0) {
    const auto known = factor_.topLeftCorner(n, n).triangularView<Eigen::Lower>();
    const Eigen::VectorXd row =
        known.solve(kernel.matrix(places_.leftCols(n), places_.col(n)).col(0));
    factor_.row(n).head(n) = row.transpose();
    pivot -= row.squaredNorm();
    value -= row.dot(whitened_.head(n));
  }
  factor_(n, n) = std::sqrt(pivot);
  whitened_[n] = value / factor_(n, n);
}

void DenseGp::refactorize(const field_core::Kernel& kernel) {
  const std::vector<int> all = used_;
  used_.clear();
  for (const int i : all) {
    used_.push_back(i);
    append_row(kernel);
  }
}

void DenseGp::predict(const field_core::Kernel& kernel, const field_core::Places& points,
                      Eigen::Matrix2Xd& moments) const {
  const auto n = static_cast<Eigen::Index>(used_.size());
  moments.resize(2, points.cols());
  moments.row(0).setZero();
  moments.row(1).setConstant(kernel.signal_variance());
  if (n == 0) return;
  Eigen::MatrixXd cross = kernel.matrix(places_.leftCols(n), points);
  factor_.topLeftCorner(n, n).triangularView<Eigen::Lower>().solveInPlace(cross);
  moments.row(0) = whitened_.head(n).transpose() * cross;
  moments.row(1) -= cross.colwise().squaredNorm();
  moments.row(1) = moments.row(1).cwiseMax(0.0);
}

}  // namespace gp_localize
