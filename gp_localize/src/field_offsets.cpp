#include "field_offsets.hpp"

#include <algorithm>
#include <cmath>

namespace gp_localize {

FieldOffsets::FieldOffsets(const GpLocalizeParams& params, const std::vector<FieldModel>& fields)
    : memory_(params.field_offset.stddev > 0.0 ? params.field_offset.memory : 0.0),
      last_(fields.size()),
      measured_(fields.size()) {
  const double share = params.field_offset.stddev;
  for (const FieldModel& field : fields) {
    prior_.push_back(share * share * field.signal_variance());
  }
  offsets_.resize(params.particles * fields.size());
  children_.reserve(offsets_.size());
  restart();
}

void FieldOffsets::restart() {
  measured_.assign(prior_.size(), false);
  for (std::size_t i = 0; i < offsets_.size(); ++i) offsets_[i] = {0.0, prior_[i % prior_.size()]};
}

void FieldOffsets::advance(int field, field_core::Stamp stamp) {
  const std::chrono::duration<double> since = stamp - last_[field];
  const bool wandered = measured_[field] && since.count() > 0.0;
  last_[field] = stamp;
  measured_[field] = true;
  if (!active() || !wandered) return;
  const double keep = std::exp(-since.count() / memory_);
  for (std::size_t i = field; i < offsets_.size(); i += prior_.size()) {
    Offset& o = offsets_[i];
    o.mean *= keep;
    o.variance = keep * keep * o.variance + (1.0 - keep * keep) * prior_[field];
  }
}

void FieldOffsets::learn(std::size_t particle, int field, double error, double variance) {
  Offset& o = offsets_[particle * prior_.size() + field];
  const double gain = o.variance / variance;
  o.mean += gain * error;
  o.variance -= gain * o.variance;
}

void FieldOffsets::resampled(const std::vector<int>& ancestors) {
  if (!active()) return;
  const std::size_t fields = prior_.size();
  children_.resize(offsets_.size());
  for (std::size_t p = 0; p < ancestors.size(); ++p) {
    std::copy_n(offsets_.begin() + ancestors[p] * fields, fields, children_.begin() + p * fields);
  }
  offsets_.swap(children_);
}

void FieldOffsets::save(field_core::State& state) const {
  if (!active()) return;
  const auto fields = static_cast<Eigen::Index>(prior_.size());
  Eigen::MatrixXd offsets(2 * fields, static_cast<Eigen::Index>(offsets_.size()) / fields);
  for (std::size_t i = 0; i < offsets_.size(); ++i) {
    offsets.data()[2 * i] = offsets_[i].mean;
    offsets.data()[2 * i + 1] = offsets_[i].variance;
  }
  Eigen::MatrixXd stamps(2, fields);  // whole seconds and nanoseconds: exact as doubles
  for (Eigen::Index f = 0; f < fields; ++f) {
    const auto ns = measured_[f] ? last_[f].count() : -1;
    stamps.col(f) << static_cast<double>(ns / 1000000000), static_cast<double>(ns % 1000000000);
  }
  state.set("offsets", offsets);
  state.set("offset_stamps", stamps);
}

void FieldOffsets::restore(const field_core::State& state, const std::vector<int>& ancestors) {
  if (!active()) return;
  if (state.numbers().count("offsets") == 0) return restart();
  const auto fields = static_cast<Eigen::Index>(prior_.size());
  const Eigen::MatrixXd& offsets = state.matrix("offsets", 2 * fields, -1);
  const Eigen::MatrixXd& stamps = state.matrix("offset_stamps", 2, fields);
  for (std::size_t p = 0; p < ancestors.size(); ++p) {
    for (Eigen::Index f = 0; f < fields; ++f) {
      offsets_[p * fields + f] = {offsets(2 * f, ancestors[p]), offsets(2 * f + 1, ancestors[p])};
    }
  }
  for (Eigen::Index f = 0; f < fields; ++f) {
    measured_[f] = stamps(1, f) >= 0.0;
    last_[f] = field_core::Stamp(static_cast<std::int64_t>(stamps(0, f)) * 1000000000 +
                                 static_cast<std::int64_t>(stamps(1, f)));
  }
}

}  // namespace gp_localize
