// Solves a BatchProblem: Gauss-Newton with step halving on a sparse Cholesky factor.
//
// Within an iteration each measurement keeps its cell, whose polynomial goes on beyond the cell's
// edge: that cost is smooth, and Newton's step for it is a good one. The true cost has kinks where
// poses cross into other cells; a search along the line for the true cost stops at the first of
// them (at a thousandth of a step in a map of 20 x 20 nodes, far from any minimum). Cells are
// assigned anew after each step, so the true cost may rise now and then: the best problem is kept.
//
// Steps are shortened instead of damped (Levenberg, Marquardt): damping by the diagonal stops
// progress along the weak directions in which the whole map may shift.
#pragma once

#include <vector>

#include "field_core/cholmod.hpp"
#include "vector_field_slam/batch_problem.hpp"
#include "vector_field_slam/block_pattern.hpp"

namespace vector_field_slam {

struct BatchOptions {
  int most_iterations = 50;  ///< linearizations
  /// Done when a step promises less than this share of the cost, or two in a row brought less. With
  /// 1000 poses and four channels 1e-4 is 0.2 of half the sum of squares: far below what a change
  /// of one standard deviation in one variable costs, 0.5.
  double tolerance = 1e-4;
};

struct BatchReport {
  int iterations = 0;
  double initial_cost = 0.0, cost = 0.0;  ///< half the sum of squares
  bool converged = false;
};

/// Blocks are numbered poses, nodes, offset. The pattern (which pose sees which nodes) is analysed
/// anew only when a measurement comes to lie in another cell. With p poses and n nodes one
/// iteration costs O(p) for the linearization and, the graph being planar up to the offset, about
/// O((p + n)^1.5) for the factor; memory O((p + n) log(p + n)).
template <int M>
class BatchOptimizer {
 public:
  explicit BatchOptimizer(const Model<M>& model) : model_(model) {}

  /// Improves the variables of the problem, from where they are, until the cost is at a minimum.
  /// @throws field_core::NumericalError if the normal matrix is not positive definite
  BatchReport optimize(BatchProblem<M>& problem, const BatchOptions& options = {});

  double cost(const BatchProblem<M>& problem) const;
  /// Derivative of cost() by all variables, in their order.
  Eigen::VectorXd gradient(BatchProblem<M>& problem);
  /// Gauss-Newton matrix at the problem's variables, lower triangle.
  const Eigen::SparseMatrix<double>& information(BatchProblem<M>& problem);

  static int pose_variable(int pose) { return kPose * pose; }
  static int node_variable(const BatchProblem<M>& problem, int node) {
    return kPose * static_cast<int>(problem.poses.size()) + M * node;
  }
  static int offset_variable(const BatchProblem<M>& problem) { return problem.variables() - 2; }

  /// Joint marginal covariance of some variables at the problem's variables (Gauss-Newton). One
  /// solve per variable asked for.
  Eigen::MatrixXd covariance(BatchProblem<M>& problem, const std::vector<int>& variables);

 private:
  static constexpr int kLocal = kRobot + 4 * M;  ///< of a measurement: pose, offset, four nodes
  static constexpr int kBlocks = 6;
  using Local = Eigen::Matrix<double, kLocal, kLocal>;
  using LocalVector = Eigen::Matrix<double, kLocal, 1>;

  /// The blocks a measurement touches, in the local order, and where their products go.
  struct Place {
    int blocks[kBlocks];
    int handles[kBlocks * (kBlocks + 1) / 2];
  };

  enum class Cells { kept, those_of_the_poses };
  double cost(const BatchProblem<M>& problem, Cells cells) const;
  /// One step from `problem`, with its cells, to `trial`; sets slope_.
  void step(BatchProblem<M>& problem, BatchProblem<M>& trial);
  GridIndex cell_at(const BatchProblem<M>& problem, const SensorPose<double>& sensor,
                    GridIndex fallback) const;
  /// Cells of all measurements at the problem's poses. @return whether any changed
  bool assign_cells(BatchProblem<M>& problem) const;
  void build_pattern(const BatchProblem<M>& problem);
  void linearize(const BatchProblem<M>& problem);
  void add_start(const BatchProblem<M>& problem);
  void add_links(const BatchProblem<M>& problem);
  void add_nodes(const BatchProblem<M>& problem);
  void add_measurements(const BatchProblem<M>& problem);
  template <class Product, class Vector>
  void add(const int* blocks, const int* sizes, int count, const Product& product,
           const Vector& right);
  /// Whitened residuals and rows of one measurement.
  void rows(const BatchProblem<M>& problem, const typename BatchProblem<M>::Measurement& m,
            GridIndex cell, const SensorPose<double>& sensor,
            Eigen::Matrix<double, M, kLocal, Eigen::RowMajor>* jacobian, double* residuals) const;
  void move(const BatchProblem<M>& from, const Eigen::VectorXd& step, BatchProblem<M>& to) const;
  void prepare(BatchProblem<M>& problem);

  int node_block(int node) const { return poses_ + node; }
  int offset_block() const { return poses_ + nodes_; }

  Model<M> model_;
  int poses_ = 0, nodes_ = 0;  // that the pattern is for
  std::size_t measurements_ = 0;
  bool has_pattern_ = false;
  BlockPattern pattern_;
  std::vector<Place> places_;  // of the measurements
  Eigen::VectorXd gradient_;
  double slope_ = 0.0;  // of the cost along the last step
  field_core::SparseCholesky factor_;
};

}  // namespace vector_field_slam
