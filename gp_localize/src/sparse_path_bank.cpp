#include "sparse_path_bank.hpp"

namespace gp_localize {

SparsePathBank::SparsePathBank(const FieldModel& field, int paths, int slice_size, Recent recent,
                               Precision precision, double interpolation_tolerance)
    : field_(field),
      slice_size_(slice_size),
      recent_(recent),
      maps_(paths, OnlineSparseGp(static_cast<int>(field.basis.size()), slice_capacity(), recent,
                                  field.basis.place_dimensions())),
      closed_(OnlineSparseGp::summary_size(static_cast<int>(field.basis.size())), paths),
      panels_(make_path_panels(field.basis, paths, slice_size, recent, precision,
                               interpolation_tolerance)) {}

void SparsePathBank::restart() {
  const OnlineSparseGp blank(static_cast<int>(field_.basis.size()), slice_capacity(), recent_,
                             field_.basis.place_dimensions());
  maps_.assign(maps_.size(), blank);
  learned_ = true;
  close_slice();
}

void SparsePathBank::add(const Places& places, double value, double noise_variance, PathBank& total,
                         Eigen::Matrix2Xd& moments) {
  panels_->add(field_.basis, places, value, noise_variance,
               static_cast<SparsePathBank&>(total).panels_.get(), moments);
}

void SparsePathBank::add_joint(const Places& places, const std::vector<Reading>& readings,
                               PathBank& total, std::vector<Eigen::Matrix2Xd>& moments) {
  panels_->add_joint(field_.basis, places, readings,
                     static_cast<SparsePathBank&>(total).panels_.get(), moments);
}

void SparsePathBank::learn(const Places& places, double value, double noise_variance) {
  field_.basis.features(places, path_features_);
  panels_->extend(field_.basis, places, path_features_, value, noise_variance);
  for (std::size_t c = 0; c < maps_.size(); ++c) {
    const double* phi = path_features_.data() + c;
    maps_[c].evaluate(field_.basis, places.col(c), phi, path_features_.cols(), evaluation_);
    maps_[c].append(places.col(c), phi, path_features_.cols(), evaluation_, value, noise_variance);
  }
  learned_ = true;
  if (maps_.front().open() == 0) close_slice();  // the slice was full
}

void SparsePathBank::close_slice() {
  if (!learned_) return;
  learned_ = false;
  for (std::size_t c = 0; c < maps_.size(); ++c) {
    maps_[c].end_slice();
    closed_.col(c) = Eigen::Map<const Eigen::VectorXd>(maps_[c].summary(), closed_.rows());
  }
  panels_->assimilate(closed_);
}

void SparsePathBank::fill(PathPanels& panels) const {
  panels.assimilate(closed_);
  std::vector<const OnlineSparseGp*> maps;
  for (const OnlineSparseGp& map : maps_) maps.push_back(&map);
  extend_by_open_rows(field_.basis, maps, panels);
}

void SparsePathBank::predict(const Places& points, Eigen::Matrix2Xd& moments) const {
  const auto panels = make_path_panels(field_.basis, static_cast<int>(maps_.size()), slice_size_,
                                       recent_, Precision::double_precision);
  fill(*panels);
  panels->add(field_.basis, points, 0.0, 0.0, nullptr, moments);
}

void SparsePathBank::save(field_core::State& state) const {
  const auto rows = OnlineSparseGp::number_count(maps_[0].support_size(), slice_capacity(),
                                                 field_.basis.place_dimensions());
  Eigen::MatrixXd numbers(rows, maps_.size());
  for (std::size_t c = 0; c < maps_.size(); ++c) {
    const std::vector<double> all = maps_[c].numbers();
    numbers.col(c) = Eigen::Map<const Eigen::VectorXd>(all.data(), rows);
  }
  state.set("map/" + field_.info.name, numbers);
  state.set("closed/" + field_.info.name, closed_);
}

void SparsePathBank::check(const field_core::State& state) const {
  const auto paths = static_cast<Eigen::Index>(maps_.size());
  state.matrix("map/" + field_.info.name,
               OnlineSparseGp::number_count(maps_[0].support_size(), slice_capacity(),
                                            field_.basis.place_dimensions()),
               paths);
  state.matrix("closed/" + field_.info.name, closed_.rows(), paths);
}

void SparsePathBank::restore(const field_core::State& state) {
  const Eigen::MatrixXd& numbers = state.matrix("map/" + field_.info.name);
  for (std::size_t c = 0; c < maps_.size(); ++c) maps_[c].restore(numbers.col(c).data());
  closed_ = state.matrix("closed/" + field_.info.name);
  learned_ = maps_.front().open() > 0;
  fill(*panels_);
}

}  // namespace gp_localize
