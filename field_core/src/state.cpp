#include "field_core/state.hpp"

#include "field_core/errors.hpp"

namespace field_core {

const Eigen::MatrixXd& State::matrix(const std::string& name, Eigen::Index rows,
                                     Eigen::Index cols) const {
  const auto it = numbers_.find(name);
  if (it == numbers_.end()) {
    throw DataError("the state has no block '" + name + "'; it was made by another version");
  }
  const Eigen::MatrixXd& m = it->second;
  if ((rows >= 0 && m.rows() != rows) || (cols >= 0 && m.cols() != cols)) {
    const auto size = [](Eigen::Index n) { return n < 0 ? std::string("any") : std::to_string(n); };
    throw DataError("the state's block '" + name + "' is " + size(m.rows()) + " x " +
                    size(m.cols()) + ", this configuration needs " + size(rows) + " x " +
                    size(cols) + "; use the configuration that the state was saved with");
  }
  return m;
}

const std::string& State::text(const std::string& name) const {
  const auto it = texts_.find(name);
  if (it == texts_.end()) {
    throw DataError("the state has no block '" + name + "'; it was made by another version");
  }
  return it->second;
}

void State::require(const std::string& estimator, std::uint32_t version) const {
  if (estimator_ != estimator) {
    throw DataError("the state belongs to '" + estimator_ + "', not to '" + estimator +
                    "'; load it with " + estimator_);
  }
  if (version_ != version) {
    throw DataError("the state has layout version " + std::to_string(version_) +
                    ", this program reads " + std::to_string(version) +
                    "; make the map again or use the program that saved it");
  }
}

}  // namespace field_core
