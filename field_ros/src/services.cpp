#include "field_ros/services.hpp"

#include <cmath>

#include "field_ros/state_file.hpp"

namespace field_ros {
namespace {

using field_core::DataError;

std::size_t field_index(const AnyEstimator& estimator, const std::string& name) {
  const auto& fields = estimator.fields();
  std::string known;
  for (std::size_t f = 0; f < fields.size(); ++f) {
    if (fields[f].name == name) return f;
    known += (known.empty() ? "" : ", ") + fields[f].name;
  }
  throw DataError("there is no field '" + name + "'; known: " + known);
}

void fill_prediction(const AnyEstimator& estimator,
                     const field_msgs::PredictField::Request& request,
                     field_msgs::PredictField::Response& response) {
  if (request.points.size() > kMostPredictedPoints) {
    throw DataError("asks for " + std::to_string(request.points.size()) +
                    " points; ask for at most " + std::to_string(kMostPredictedPoints) +
                    " at once");
  }
  std::vector<std::size_t> rows;
  for (const auto& name : request.names) rows.push_back(field_index(estimator, name));
  if (request.names.empty()) {
    for (std::size_t f = 0; f < estimator.fields().size(); ++f) rows.push_back(f);
  }
  Eigen::Matrix2Xd points(2, static_cast<Eigen::Index>(request.points.size()));
  for (std::size_t i = 0; i < request.points.size(); ++i) {
    const auto& p = request.points[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) {
      throw DataError("point " + std::to_string(i + 1) + " is not finite");
    }
    points.col(static_cast<Eigen::Index>(i)) << p.x, p.y;
  }
  const field_core::FieldPrediction prediction = estimator.predict_field(points);
  for (const std::size_t f : rows) {
    response.names.push_back(estimator.fields()[f].name);
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      response.mean.push_back(prediction.mean(static_cast<Eigen::Index>(f), i));
      response.variance.push_back(prediction.variance(static_cast<Eigen::Index>(f), i));
    }
  }
}

// Runs `body`, which returns the message of success.
template <class Response, class Body>
Response answer(Body body) {
  Response response;
  try {
    response.message = body(response);
    response.success = true;
  } catch (const std::exception& e) {
    response = Response();
    response.success = false;
    response.message = e.what();
  }
  return response;
}

}  // namespace

field_msgs::PredictField::Response predict_field(const AnyEstimator& estimator,
                                                 const field_msgs::PredictField::Request& request) {
  return answer<field_msgs::PredictField::Response>([&](auto& response) {
    fill_prediction(estimator, request, response);
    return "";
  });
}

field_msgs::SaveState::Response save_state(const Session& session, const std::string& name) {
  return answer<field_msgs::SaveState::Response>([&](auto&) {
    const std::string path = state_path(session.params().state_directory, name);
    create_directories(path.substr(0, path.rfind('/')));
    write_state_file(path, session.save_state());
    return "saved " + path;
  });
}

field_msgs::LoadState::Response load_state(Session& session, const std::string& name) {
  return answer<field_msgs::LoadState::Response>([&](auto&) {
    const std::string path = state_path(session.params().state_directory, name);
    session.restore(read_state_file(path));
    return "loaded " + path;
  });
}

Services::Services(ros::NodeHandle& handle, ros::NodeHandle& private_handle, Session& session,
                   std::function<void()> on_change) {
  using Empty = std_srvs::Empty;
  const auto advertise = [this](ros::NodeHandle& where, const char* name, auto types,
                                auto callback) {
    using Service = decltype(types);
    using Callback = boost::function<bool(typename Service::Request&, typename Service::Response&)>;
    servers_.push_back(where.advertiseService(name, Callback(callback)));
  };
  advertise(private_handle, "predict_field", field_msgs::PredictField(),
            [&session](auto& request, auto& response) {
              response = predict_field(session.estimator(), request);
              return true;
            });
  advertise(private_handle, "save_state", field_msgs::SaveState(),
            [&session](auto& request, auto& response) {
              response = save_state(session, request.name);
              return true;
            });
  advertise(private_handle, "load_state", field_msgs::LoadState(),
            [&session, on_change](auto& request, auto& response) {
              response = load_state(session, request.name);
              if (response.success) on_change();
              return true;
            });
  advertise(private_handle, "reset", Empty(), [&session, on_change](auto&, auto&) {
    session.reset();
    on_change();
    return true;
  });
  advertise(private_handle, "pause", std_srvs::SetBool(),
            [&session](auto& request, auto& response) {
              session.set_paused(request.data);
              response.success = true;
              response.message = request.data ? "paused" : "running";
              return true;
            });
  advertise(handle, "global_localization", Empty(), [&session, on_change](auto&, auto&) {
    for (int robot = 0; robot < session.robots(); ++robot) session.scatter(robot);
    on_change();
    return true;
  });
  for (int robot = 0; robot < session.robots() && session.robots() > 1; ++robot) {
    const std::string name = session.interface(robot).prefix + "global_localization";
    advertise(handle, name.c_str(), Empty(), [&session, on_change, robot](auto&, auto&) {
      session.scatter(robot);
      on_change();
      return true;
    });
  }
}

}  // namespace field_ros
