// The typed errors of the suite. Programs turn DataError and NumericalError into exit code 1.
#pragma once

#include <stdexcept>
#include <string>

namespace field_core {

/// Input that cannot be used: the text names the file, line, key or topic, and what to do.
struct DataError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A parameter that is unknown, missing, of the wrong type or out of range.
struct ParameterError : DataError {
  /// @param key full key, such as "fields/light/noise_stddev"
  /// @param problem what is wrong with its value and what is allowed
  ParameterError(const std::string& key, const std::string& problem)
      : DataError("parameter '" + key + "': " + problem), key(key) {}
  std::string key;
};

/// A computation that has no usable result (a matrix not positive definite, ...): the text names
/// the cause and the remedy.
struct NumericalError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace field_core
