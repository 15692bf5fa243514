// The complete state of an estimator as named blocks, independent of how it is stored.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>

namespace field_core {

/// Blocks of numbers (matrices; scalars are 1 x 1) and of text, by name.
class State {
 public:
  State() = default;
  State(std::string estimator, std::uint32_t version)
      : estimator_(std::move(estimator)), version_(version) {}

  const std::string& estimator() const { return estimator_; }
  std::uint32_t version() const { return version_; }

  void set(const std::string& name, const Eigen::Ref<const Eigen::MatrixXd>& block) {
    numbers_[name] = block;
  }
  void set(const std::string& name, double value) {
    numbers_[name] = Eigen::MatrixXd::Constant(1, 1, value);
  }
  void set_text(const std::string& name, const std::string& text) { texts_[name] = text; }

  /// @throws DataError naming the block if it is missing, or its shape is not rows x cols (-1: any)
  const Eigen::MatrixXd& matrix(const std::string& name, Eigen::Index rows = -1,
                                Eigen::Index cols = -1) const;
  double scalar(const std::string& name) const { return matrix(name, 1, 1)(0, 0); }
  const std::string& text(const std::string& name) const;

  /// @throws DataError saying what differs unless the state is of this estimator and version
  void require(const std::string& estimator, std::uint32_t version) const;

  const std::map<std::string, Eigen::MatrixXd>& numbers() const { return numbers_; }
  const std::map<std::string, std::string>& texts() const { return texts_; }

 private:
  std::string estimator_;
  std::uint32_t version_ = 0;
  std::map<std::string, Eigen::MatrixXd> numbers_;
  std::map<std::string, std::string> texts_;
};

}  // namespace field_core
