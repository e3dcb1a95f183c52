#include "server/calibration/store/stored_calibration.h"

#include <fmt/format.h>
#include <openssl/sha.h>

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "server/text/limited_json.h"

namespace hapticd::server {

namespace {

using calibration::CalibrationKind;
using Json = nlohmann::ordered_json;

constexpr unsigned kFormat = 1;

template <class Matrix>
Json numbers(const Matrix& m) {
  Json list = Json::array();
  for (Eigen::Index i = 0; i < m.size(); ++i) list.push_back(m.data()[i]);
  return list;
}
Json numbers(const Eigen::Quaterniond& q) {
  return Json{q.w(), q.x(), q.y(), q.z()};
}
Json object(const rt::RigidTransform& t) {
  return {{"rotation", numbers(t.rotation)}, {"translation_mm", numbers(t.translation_mm)}};
}
Json object(const rt::ArmModel& arm) {
  return {{"use", static_cast<int>(arm.use)},
          {"rig_from_base", object(arm.rig_from_base)},
          {"first_link_mm", arm.first_link_mm},
          {"second_link_mm", arm.second_link_mm},
          {"joint_gain", numbers(arm.joint_gain)},
          {"joint_offset_rad", numbers(arm.joint_offset_rad)},
          {"gimbal_gain", numbers(arm.gimbal_gain)},
          {"gimbal_offset_rad", numbers(arm.gimbal_offset_rad)},
          {"gimbal_to_tool", numbers(arm.gimbal_to_tool)},
          {"tip_offset_mm", numbers(arm.tip_offset_mm)}};
}

/// A count, or one of numbered choices. A number that was written as a floating one is none: turning it into
/// an integer has no defined result once it is too large.
std::uint64_t whole_number(const Json& json) {
  if (!json.is_number_unsigned()) throw std::runtime_error("a whole number from 0 on is none");
  return json.get<std::uint64_t>();
}
double number(const Json& json) {
  const double value = json.get<double>();
  if (!std::isfinite(value)) throw std::runtime_error("a number is not finite");
  return value;
}
template <class Matrix>
void take(const Json& list, Matrix& m) {
  if (list.size() != static_cast<std::size_t>(m.size()))
    throw std::runtime_error("a list has another length");
  for (Eigen::Index i = 0; i < m.size(); ++i) m.data()[i] = number(list.at(static_cast<std::size_t>(i)));
}
void take(const Json& list, Eigen::Quaterniond& q) {
  q = Eigen::Quaterniond(number(list.at(0)), number(list.at(1)), number(list.at(2)), number(list.at(3)));
  if (std::abs(q.norm() - 1.0) > 1e-6) throw std::runtime_error("a rotation is none");
}
void take(const Json& json, rt::RigidTransform& t) {
  take(json.at("rotation"), t.rotation);
  take(json.at("translation_mm"), t.translation_mm);
}
void take(const Json& json, rt::ArmModel& arm) {
  const std::uint64_t use = whole_number(json.at("use"));
  if (use > static_cast<std::uint64_t>(rt::AngleUse::kPose)) throw std::runtime_error("'use' is unknown");
  arm.use = static_cast<rt::AngleUse>(use);
  take(json.at("rig_from_base"), arm.rig_from_base);
  arm.first_link_mm = number(json.at("first_link_mm"));
  arm.second_link_mm = number(json.at("second_link_mm"));
  take(json.at("joint_gain"), arm.joint_gain);
  take(json.at("joint_offset_rad"), arm.joint_offset_rad);
  take(json.at("gimbal_gain"), arm.gimbal_gain);
  take(json.at("gimbal_offset_rad"), arm.gimbal_offset_rad);
  take(json.at("gimbal_to_tool"), arm.gimbal_to_tool);
  take(json.at("tip_offset_mm"), arm.tip_offset_mm);
}

/// The fit's plain numbers, in their order in the file.
template <class Fit, class Each>
void for_numbers(Fit& fit, Each&& each) {
  each("clock_drift", fit.clock_drift);
  each("latency_s", fit.latency_s);
  each("latency_sd_s", fit.latency_sd_s);
  each("tracker_noise_mm", fit.tracker_noise_mm);
  each("tracker_noise_rad", fit.tracker_noise_rad);
  each("residual_rms_mm", fit.residual_rms_mm);
  each("left_out_rms_mm", fit.left_out_rms_mm);
  each("left_out_place_rms_mm", fit.left_out_place_rms_mm);
  each("predicted_median_mm", fit.predicted_median_mm);
  each("predicted_95_mm", fit.predicted_95_mm);
  each("predicted_rms_mm", fit.predicted_rms_mm);
  each("predicted_orientation_rad", fit.predicted_orientation_rad);
}

std::string sha256(const std::string& text) {
  unsigned char digest[SHA256_DIGEST_LENGTH];
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest);
  std::string hex;
  for (const unsigned char byte : digest) hex += fmt::format("{:02x}", byte);
  return hex;
}

}  // namespace

const char* name_of(CalibrationKind kind) noexcept {
  switch (kind) {
    case CalibrationKind::kTip:
      return "tip";
    case CalibrationKind::kRegistration:
      return "registration";
    case CalibrationKind::kKinematics:
      return "kinematics";
  }
  return "";
}

std::string calibration_text(const StoredCalibration& stored) {
  const auto& fit = stored.fit;
  const auto& c = fit.calibration;
  Json json{{"format", kFormat}, {"kind", name_of(stored.kind)}, {"created", stored.created},
            {"rig", stored.rig}, {"poses", fit.poses},           {"outliers", fit.outliers}};
  for_numbers(fit, [&json](const char* name, double value) { json[name] = value; });
  if (stored.tip_in_marker_mm) {
    json["tip_in_marker_mm"] = numbers(*stored.tip_in_marker_mm);
    json["tip_covariance_mm2"] = numbers(stored.tip_covariance_mm2);
  }
  if (stored.kind != CalibrationKind::kTip) {
    json["nominal"] = object(c.nominal);
    json["arm"] = object(c.arm);
    json["reference_from_rig"] = object(c.reference_from_rig);
    json["device_from_rig"] = object(c.device_from_rig);
    json["tool_from_marker"] = object(fit.tool_from_marker);
    json["covariance"] = numbers(c.covariance);
    json["misfit_mm2"] = numbers(c.misfit_mm2);
    json["orientation_misfit_rad"] = c.orientation_misfit_rad;
    json["parameters"] = Json::array();
    for (const auto& p : fit.parameters) {
      json["parameters"].push_back({{"name", p.name},
                                    {"value", p.value},
                                    {"standard_error", p.standard_error},
                                    {"nominal", p.nominal},
                                    {"unit", p.unit}});
    }
    json["target_error"] = Json::array();
    for (const TargetErrorPoint& point : stored.target_error) {
      json["target_error"].push_back(
          {{"position_mm", numbers(point.position_mm)}, {"covariance_mm2", numbers(point.covariance_mm2)}});
    }
  }
  return json.dump(1);
}

hal::Result<StoredCalibration> read_calibration(const std::string& text) {
  StoredCalibration stored;
  try {
    const auto json = parse_limited_json<Json>(text);
    if (whole_number(json.at("format")) != kFormat) throw std::runtime_error("another format");
    const std::string kind = json.at("kind").get<std::string>();
    for (const CalibrationKind k :
         {CalibrationKind::kTip, CalibrationKind::kRegistration, CalibrationKind::kKinematics}) {
      if (kind == name_of(k)) stored.kind = k;
    }
    if (kind != name_of(stored.kind)) throw std::runtime_error("unknown kind '" + kind + "'");
    stored.created = json.at("created").get<std::string>();
    stored.rig = json.at("rig").get<std::string>();
    auto& fit = stored.fit;
    auto& c = fit.calibration;
    fit.poses = whole_number(json.at("poses"));
    fit.outliers = whole_number(json.at("outliers"));
    for_numbers(fit, [&json](const char* name, double& value) { value = number(json.at(name)); });
    if (json.contains("tip_in_marker_mm")) {
      stored.tip_in_marker_mm.emplace();
      take(json.at("tip_in_marker_mm"), *stored.tip_in_marker_mm);
      take(json.at("tip_covariance_mm2"), stored.tip_covariance_mm2);
    }
    if (stored.kind != CalibrationKind::kTip) {
      take(json.at("nominal"), c.nominal);
      take(json.at("arm"), c.arm);
      take(json.at("reference_from_rig"), c.reference_from_rig);
      take(json.at("device_from_rig"), c.device_from_rig);
      take(json.at("tool_from_marker"), fit.tool_from_marker);
      take(json.at("covariance"), c.covariance);
      take(json.at("misfit_mm2"), c.misfit_mm2);
      c.orientation_misfit_rad = number(json.at("orientation_misfit_rad"));
      for (const Json& p : json.at("parameters")) {
        fit.parameters.push_back({p.at("name").get<std::string>(), number(p.at("value")),
                                  number(p.at("standard_error")), number(p.at("nominal")),
                                  p.at("unit").get<std::string>()});
      }
      for (const Json& p : json.at("target_error")) {
        TargetErrorPoint point;
        take(p.at("position_mm"), point.position_mm);
        take(p.at("covariance_mm2"), point.covariance_mm2);
        stored.target_error.push_back(point);
      }
      c.registered = true;
      c.tracker_latency_s = fit.latency_s;
      c.tracker_latency_sd_s = fit.latency_sd_s;
    }
  } catch (const std::exception& error) {
    return hal::Error{"a calibration cannot be read", "calibrations", error.what(),
                      "a file that hapticd wrote", "delete the file, or restore it"};
  }
  stored.hash = sha256(text);
  stored.fit.calibration.name = stored.hash;
  return stored;
}

}  // namespace hapticd::server
