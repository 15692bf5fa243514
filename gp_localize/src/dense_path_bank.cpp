#include "dense_path_bank.hpp"

#include <algorithm>
#include <cmath>

#include "field_core/errors.hpp"

namespace gp_localize {

DensePathBank::DensePathBank(const FieldModel& field, const GpLocalizeParams& params)
    : field_(field),
      model_(params.observation_model),
      subset_size_(params.subset_size),
      slice_size_(params.slice_size),
      tolerance_(params.interpolation_tolerance),
      // Offline PITC keeps its measurements in a DenseGp that uses none but the last of them.
      paths_(params.sample_paths, model_ == ObservationModelType::offline_pitc
                                      ? DenseGp(ObservationModelType::sod_truncate, 1)
                                      : DenseGp(model_, subset_size_)) {}

void DensePathBank::restart() {
  const DenseGp blank = model_ == ObservationModelType::offline_pitc
                            ? DenseGp(ObservationModelType::sod_truncate, 1)
                            : DenseGp(model_, subset_size_);
  paths_.assign(paths_.size(), blank);
}

void DensePathBank::begin(int particles) {
  log_densities_.setZero(particles, static_cast<Eigen::Index>(paths_.size()));
}

void DensePathBank::add(const Places& places, double value, double noise_variance, PathBank& total,
                        Eigen::Matrix2Xd& moments) {
  Eigen::MatrixXd& sums = static_cast<DensePathBank&>(total).log_densities_;
  moments.setZero(2, places.cols());
  const bool shared = fit_box(places, noise_variance);
  const Places at = shared ? Places(box_.nodes()) : places;
  const Eigen::Map<const Eigen::MatrixXd> coefficients(box_.coefficients().data(), places.cols(),
                                                       shared ? at.cols() : 0);
  Eigen::Matrix2Xd path, nodes;
  for (std::size_t c = 0; c < paths_.size(); ++c) {
    if (shared) {
      predict_path(c, at, nodes);
      path.noalias() = nodes * coefficients.transpose();
      path.row(1) = path.row(1).cwiseMax(0.0);
    } else {
      predict_path(c, at, path);
    }
    path.row(1).array() += noise_variance;
    const Eigen::ArrayXd error = value - path.row(0).transpose().array();
    const Eigen::ArrayXd variance = path.row(1).transpose().array();
    sums.col(c).array() -= 0.5 * (error.square() / variance + variance.log());
    moments.row(0) += path.row(0);
    moments.row(1) += path.row(1) + path.row(0).cwiseAbs2();
  }
  moments /= static_cast<double>(paths_.size());
}

bool DensePathBank::fit_box(const Places& places, double noise_variance) {
  if (model_ == ObservationModelType::offline_pitc) return false;
  const field_core::Kernel& kernel = field_.basis.kernel();
  constexpr double kKernel = 10.0;  // multiplications that an exponential is worth
  const double used = paths_.front().used();
  double norm = 0.0;
  for (const DenseGp& path : paths_) norm = std::max(norm, path.mean_norm());
  return box_.fit_where_it_pays(kernel, places, tolerance_, noise_variance,
                                kernel.signal_variance(), norm, used * (0.5 * used + kKernel));
}

void DensePathBank::log_mean(std::vector<double>& out) const {
  const Eigen::ArrayXd largest = log_densities_.rowwise().maxCoeff();
  const Eigen::ArrayXd sums = (log_densities_.array().colwise() - largest).exp().rowwise().mean();
  out.resize(largest.size());
  for (Eigen::Index p = 0; p < largest.size(); ++p) out[p] = largest[p] + std::log(sums[p]);
}

void DensePathBank::learn(const Places& places, double value, double noise_variance) {
  for (std::size_t c = 0; c < paths_.size(); ++c) {
    paths_[c].append(field_.basis.kernel(), places.col(c), value, noise_variance);
  }
}

void DensePathBank::predict_path(std::size_t path, const Places& places,
                                 Eigen::Matrix2Xd& moments) const {
  if (model_ == ObservationModelType::offline_pitc) {
    offline_pitc(paths_[path], places, moments);
  } else {
    paths_[path].predict(field_.basis.kernel(), places, moments);
  }
}

/// Eq. (5)-(6) over all measurements, the last block as long as it is.
void DensePathBank::offline_pitc(const DenseGp& path, const Places& places,
                                 Eigen::Matrix2Xd& moments) const {
  const SupportBasis& basis = field_.basis;
  OnlineSparseGp gp(static_cast<int>(basis.size()), slice_size_, Recent::used, basis.dimensions());
  OnlineSparseGp::Evaluation at;
  Features phi;
  for (const Measured& d : path.data()) {
    basis.features(d.place, phi);
    gp.evaluate(basis, d.place, phi.data(), 1, at);
    gp.append(d.place, phi.data(), 1, at, d.value, d.noise_variance);
  }
  gp.end_slice();
  basis.features(places, phi);
  moments.resize(2, places.cols());
  for (Eigen::Index p = 0; p < places.cols(); ++p) {
    gp.evaluate(basis, places.col(p), phi.data() + p, phi.cols(), at);
    moments.col(p) << at.mean, at.variance;
  }
}

void DensePathBank::predict(const Places& points, Eigen::Matrix2Xd& moments) const {
  moments.setZero(2, points.cols());
  Eigen::Matrix2Xd path;
  for (std::size_t c = 0; c < paths_.size(); ++c) {
    predict_path(c, points, path);
    moments.row(0) += path.row(0);
    moments.row(1) += path.row(1) + path.row(0).cwiseAbs2();
  }
  moments /= static_cast<double>(paths_.size());
}

void DensePathBank::save(field_core::State& state) const {
  const auto count = static_cast<Eigen::Index>(paths_[0].data().size());
  const Eigen::Index rows = field_.basis.dimensions() + 2;
  Eigen::MatrixXd data(rows * count, paths_.size());
  for (std::size_t c = 0; c < paths_.size(); ++c) {
    for (Eigen::Index i = 0; i < count; ++i) {
      const Measured& d = paths_[c].data()[i];
      data.col(c).segment(rows * i, rows) << d.place, d.value, d.noise_variance;
    }
  }
  state.set("data/" + field_.info.name, data);
}

void DensePathBank::check(const field_core::State& state) const {
  const std::string name = "data/" + field_.info.name;
  if (state.matrix(name, -1, static_cast<Eigen::Index>(paths_.size())).rows() %
          (field_.basis.dimensions() + 2) !=
      0) {
    throw field_core::DataError("the state's block '" + name + "' is damaged; make the map again");
  }
}

void DensePathBank::restore(const field_core::State& state) {
  const Eigen::MatrixXd& data = state.matrix("data/" + field_.info.name);
  restart();
  for (std::size_t c = 0; c < paths_.size(); ++c) {
    const Eigen::Index d = field_.basis.dimensions();
    for (Eigen::Index i = 0; i < data.rows(); i += d + 2) {
      paths_[c].append(field_.basis.kernel(), data.col(c).segment(i, d), data(i + d, c),
                       data(i + d + 1, c));
    }
  }
}

}  // namespace gp_localize
