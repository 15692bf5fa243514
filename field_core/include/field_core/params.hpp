// How a parameter struct declares itself.
//
// A parameter struct names each of its fields once, in visit(), with range, unit and one line of
// documentation; the default is the member's initial value. Loading from YAML or rosparam, the
// strict checks, the commented YAML and the tables of the documentation all come from this one
// declaration:
//
//   struct WidgetParams {
//     int count = 10;
//     double width = 0.5;
//     Shape shape = Shape::round;
//
//     template <class Visitor>
//     void visit(Visitor& v) {
//       v.number("count", count, {1, 1000}, "1", "how many widgets");
//       v.number("width", width, positive(), "m", "outer width");
//       v.choice("shape", shape, {{"round", Shape::round}, {"square", Shape::square}}, "outline");
//     }
//     void validate() const;  // optional: rules between fields; throws ParameterError
//   };
//
// A Visitor offers, and a struct may use, exactly these members:
//   number(key, int& | double&, Range, unit, doc)
//   flag(key, bool&, doc)
//   text(key, std::string&, doc)
//   numbers(key, std::vector<double>&, Size, Range, unit, doc)   a list
//   points(key, std::vector<Eigen::Vector2d>&, unit, doc)        a list of [x, y]
//   choice(key, E&, Choices<E>, doc)                             an enum by name
//   group(key, Struct&, doc)                                     a struct with its own visit()
//   dictionary(key, std::map<std::string, Struct>&, doc)         structs under the user's names
//   list(key, std::vector<Struct>&, doc)                         structs one after the other
//   texts(key, std::vector<std::string>&, doc)                   a list of names
// Every key may be left out unless `required` says so: v.required("key") before the member call.
#pragma once

#include <limits>
#include <utility>
#include <vector>

namespace field_core {

/// Allowed values: low..high, the ends included unless `open_low`.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool open_low = false;
};
inline Range positive() { return {0.0, std::numeric_limits<double>::infinity(), true}; }
inline Range non_negative() { return {0.0, std::numeric_limits<double>::infinity(), false}; }
inline Range any_number() { return {}; }

/// Allowed lengths of a list.
struct Size {
  std::size_t low = 0;
  std::size_t high = std::numeric_limits<std::size_t>::max();
};

template <class E>
using Choices = std::vector<std::pair<const char*, E>>;

}  // namespace field_core
