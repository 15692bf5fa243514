#include "field_ros/program.hpp"

#include <algorithm>
#include <exception>
#include <iostream>
#include <string>

namespace field_ros {

int run_guarded(const std::function<int()>& body) {
  try {
    return body();
  } catch (const std::exception& e) {
    std::string text = e.what();
    std::replace(text.begin(), text.end(), '\n', ' ');
    std::cerr << "error: " << text << std::endl;
    return kExitBadData;
  }
}

}  // namespace field_ros
