#include "field_core/random.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <locale>
#include <sstream>

#include "field_core/errors.hpp"

namespace field_core {

std::size_t Random::index(std::size_t count) {
  return std::min(count - 1, static_cast<std::size_t>(uniform() * static_cast<double>(count)));
}

double Random::normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  double u, v, s;
  do {
    u = 2.0 * uniform() - 1.0;
    v = 2.0 * uniform() - 1.0;
    s = u * u + v * v;
  } while (s >= 1.0 || s == 0.0);
  const double factor = std::sqrt(-2.0 * std::log(s) / s);
  spare_ = v * factor;
  has_spare_ = true;
  return u * factor;
}

double Random::student_t(double degrees) {
  // Bailey (1994): the polar method for Student's t.
  double u, v, s;
  do {
    u = 2.0 * uniform() - 1.0;
    v = 2.0 * uniform() - 1.0;
    s = u * u + v * v;
  } while (s >= 1.0 || s == 0.0);
  return u * std::sqrt(degrees * (std::pow(s, -2.0 / degrees) - 1.0) / s);
}

Eigen::Vector3d Random::normal3(const Eigen::Matrix3d& covariance) {
  const Eigen::LDLT<Eigen::Matrix3d> factor(covariance);
  Eigen::Vector3d draw;
  for (int i = 0; i < 3; ++i) draw[i] = normal();  // arguments of a call have no defined order
  draw = factor.vectorD().cwiseMax(0.0).cwiseSqrt().asDiagonal() * draw;
  draw = factor.matrixL() * draw;
  return factor.transpositionsP().transpose() * draw;
}

std::string Random::state() const {
  std::ostringstream out;
  std::uint64_t bits;
  std::memcpy(&bits, &spare_, sizeof bits);
  out.imbue(std::locale::classic());
  out << (has_spare_ ? 1 : 0) << ' ' << bits << ' ' << engine_;
  return out.str();
}

void Random::restore(const std::string& state) {
  std::istringstream in(state);
  in.imbue(std::locale::classic());
  int has_spare = 0;
  std::uint64_t bits = 0;
  std::mt19937_64 engine;
  if (!(in >> has_spare >> bits >> engine)) {
    throw DataError("the random generator's state is not readable; the state file is damaged");
  }
  has_spare_ = has_spare != 0;
  std::memcpy(&spare_, &bits, sizeof bits);
  engine_ = engine;
}

}  // namespace field_core
