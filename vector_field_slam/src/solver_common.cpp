#include "solver_common.hpp"

#include "vector_field_slam/node_table.hpp"

namespace vector_field_slam {

std::vector<GridIndex> load_node_indices(const field_core::State& state) {
  const Eigen::MatrixXd& m = state.matrix("node_indices", 2, -1);
  std::vector<GridIndex> indices;
  NodeTable table;
  for (Eigen::Index i = 0; i < m.cols(); ++i) {
    const bool valid = m.col(i).cwiseAbs().maxCoeff() <= GridGeometry<double>::kLargestIndex + 1;
    const GridIndex index{static_cast<std::int16_t>(valid ? m(0, i) : 0),
                          static_cast<std::int16_t>(valid ? m(1, i) : 0)};
    if (!valid || table.find(index) >= 0) {
      throw field_core::DataError("state block 'node_indices': node " + std::to_string(i) +
                                  " is not a new index of the grid; the file is damaged");
    }
    table.insert(index);
    indices.push_back(index);
  }
  return indices;
}

}  // namespace vector_field_slam
