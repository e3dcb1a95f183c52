#include "hal/daq/calibration.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <pugixml.hpp>
#include <span>

#include "hal/daq/calibration_units.h"

namespace hapticd::daq {

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr std::size_t kMaxFile = std::size_t{1} << 20U;
constexpr std::string_view kAxisNames[] = {"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};
/// Smallest singular value of the rows scaled to length one: above 0.1 for a real sensor, zero for a
/// repeated row.
constexpr double kMinSingularValue = 1e-4;
/// Bound beyond any real gauge amplifier or sensor; keeps sums and products finite.
constexpr double kMaxNumber = 1e12;

/// Makes errors that name the file.
class Reader {
 public:
  explicit Reader(std::string source) : source_(std::move(source)) {}

  hal::Error error(std::string what, std::string_view element, std::string value, std::string limit) const {
    return hal::Error::of(hal::ErrorCode::kMalformed, std::move(what),
                          element.empty() ? source_ : fmt::format("{}, {}", source_, element),
                          std::move(value), std::move(limit), "take the file that came with the sensor");
  }

  hal::Result<std::string> text(const pugi::xml_node& node, const char* name,
                                std::string_view element) const {
    const pugi::xml_attribute attribute = node.attribute(name);
    if (!attribute) return error(fmt::format("attribute {} is missing", name), element, "", "");
    return std::string(attribute.value());
  }

  /// One number; `otherwise` if the attribute is absent.
  hal::Result<double> number(const pugi::xml_node& node, const char* name, std::string_view element,
                             std::optional<double> otherwise) const {
    const pugi::xml_attribute attribute = node.attribute(name);
    if (!attribute && otherwise) return *otherwise;
    auto value = text(node, name, element);
    if (!value) return value.error();
    double number = 0.0;
    if (!numbers_of(*value, {&number, 1})) {
      return error(fmt::format("attribute {} is not a number", name), element, shortened(*value),
                   "one finite number");
    }
    return number;
  }

  hal::Result<Vector6> row(const pugi::xml_node& node, std::string_view element) const {
    auto value = text(node, "values", element);
    if (!value) return value.error();
    Vector6 row;
    if (!numbers_of(*value, {row.data(), kGauges})) {
      return error("attribute values is not a row of the matrix", element, shortened(*value),
                   fmt::format("{} finite numbers", kGauges));
    }
    return row;
  }

  hal::Result<double> unit(const pugi::xml_node& node, const char* name, std::string_view element,
                           std::span<const CalibrationUnit> units, const char* otherwise = nullptr) const {
    std::string value;
    if (otherwise != nullptr && !node.attribute(name)) {
      value = otherwise;
    } else {
      auto read = text(node, name, element);
      if (!read) return read.error();
      value = *read;
    }
    std::string known;
    for (const CalibrationUnit& unit : units) {
      if (unit.name == value) return unit.factor;
      known += known.empty() ? "" : ", ";
      known += unit.name;
    }
    return error(fmt::format("attribute {} is an unknown unit", name), element, shortened(value), known);
  }

  static std::string shortened(std::string_view text) {
    std::string kept;
    for (const char c : text.substr(0, 60)) kept += c >= ' ' && c <= '~' ? c : '?';
    return text.size() > 60 ? kept + "…" : kept;
  }

 private:
  /// True when the text is exactly that many finite numbers.
  static bool numbers_of(std::string_view text, std::span<double> numbers) {
    const auto is_space = [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; };
    std::size_t found = 0;
    const char* at = text.data();
    const char* const end = text.data() + text.size();
    for (;;) {
      while (at != end && is_space(*at)) ++at;
      if (at == end) return found == numbers.size();
      if (found == numbers.size()) return false;
      if (*at == '+') ++at;
      const auto [after, failure] = std::from_chars(at, end, numbers[found]);
      if (failure != std::errc{} || (after != end && !is_space(*after))) return false;
      if (!(std::abs(numbers[found]) <= kMaxNumber)) return false;
      at = after;
      ++found;
    }
  }

  std::string source_;
};

/// The rows of all six axes, in order.
struct Axes6 {
  Matrix6 rows;
  Vector6 max_load;
};

/// Elements `element` ("Axis" or "UserAxis"); `scaled`: each row comes with the factor it was made with.
hal::Result<Axes6> read_axes(const Reader& reader, const pugi::xml_node& calibration, const char* element,
                             bool scaled) {
  Axes6 axes;
  std::array<bool, 6> found{};
  for (const pugi::xml_node& node : calibration.children(element)) {
    auto name = reader.text(node, "Name", element);
    if (!name) return name.error();
    std::size_t i = 0;
    while (i < 6 && kAxisNames[i] != *name) ++i;
    const std::string place = fmt::format("{} {}", element, Reader::shortened(*name));
    if (i == 6) return reader.error("unknown axis", place, "", "Fx, Fy, Fz, Tx, Ty, Tz");
    if (found[i]) return reader.error("an axis appears twice", place, "", "each once");
    found[i] = true;
    auto row = reader.row(node, place);
    if (!row) return row.error();
    auto scale = reader.number(node, "scale", place, 1.0);
    if (!scale) return scale.error();
    if (scaled && !(std::abs(*scale) > 1.0 / kMaxNumber)) {
      return reader.error("the scale is zero", place, fmt::format("{}", *scale), "a number other than zero");
    }
    auto max_load = reader.number(node, "max", place, 0.0);
    if (!max_load) return max_load.error();
    const auto r = static_cast<Eigen::Index>(i);
    axes.rows.row(r) = row->transpose() / (scaled ? *scale : 1.0);
    axes.max_load[r] = std::abs(*max_load);
  }
  for (std::size_t i = 0; i < 6; ++i) {
    if (!found[i]) {
      return reader.error("an axis is missing", fmt::format("{} {}", element, kAxisNames[i]), "",
                          "Fx, Fy, Fz, Tx, Ty, Tz");
    }
  }
  return axes;
}

/// Moves a load (N, N·mm) to where and how the sensor's maker wants it reported.
hal::Result<Matrix6> read_transform(const Reader& reader, const pugi::xml_node& calibration) {
  constexpr const char* kElement = "BasicTransform";
  const pugi::xml_node node = calibration.child(kElement);
  if (!node) return Matrix6(Matrix6::Identity());
  auto mm = reader.unit(calibration, "DistUnits", "Calibration", kDistanceUnits);
  if (!mm) return mm.error();
  auto rad = reader.unit(calibration, "AngleUnits", "Calibration", kAngleUnits, "degrees");
  if (!rad) return rad.error();
  std::array<double, 6> values{};
  constexpr const char* kNames[] = {"Dx", "Dy", "Dz", "Rx", "Ry", "Rz"};
  for (std::size_t i = 0; i < 6; ++i) {
    auto value = reader.number(node, kNames[i], kElement, 0.0);
    if (!value) return value.error();
    values[i] = *value * (i < 3 ? *mm : *rad);
  }
  using Axis = Eigen::Vector3d;
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(-values[5], Axis::UnitZ()) * Eigen::AngleAxisd(-values[4], Axis::UnitY()) *
       Eigen::AngleAxisd(-values[3], Axis::UnitX()))
          .toRotationMatrix();
  Eigen::Matrix3d cross;
  cross << 0.0, -values[2], values[1],  //
      values[2], 0.0, -values[0],       //
      -values[1], values[0], 0.0;
  Matrix6 transform = Matrix6::Zero();
  transform.topLeftCorner<3, 3>() = turn;
  transform.bottomRightCorner<3, 3>() = turn;
  transform.bottomLeftCorner<3, 3>() = -turn * cross;
  return transform;
}

std::optional<hal::Error> check_matrix(const Reader& reader, const Matrix6& matrix,
                                       std::string_view element) {
  Matrix6 scaled = matrix;
  bool fit = matrix.allFinite();
  for (Eigen::Index i = 0; fit && i < 6; ++i) {
    const double norm = matrix.row(i).norm();
    fit = norm > 0.0 && std::isfinite(norm);
    if (fit) scaled.row(i) /= norm;
  }
  if (fit) {
    // The rows' lengths are units; what is left says whether six gauges show six loads apart.
    const Eigen::JacobiSVD<Matrix6> svd(scaled);
    fit = svd.singularValues().allFinite() && svd.singularValues()[5] > kMinSingularValue;
  }
  if (fit) return std::nullopt;
  return reader.error("the matrix is singular", element, "", "six independent rows");
}

hal::Result<pugi::xml_node> choose(const Reader& reader, const pugi::xml_node& root,
                                   std::string_view part_number) {
  pugi::xml_node chosen;
  std::size_t count = 0;
  std::string known;
  for (const pugi::xml_node& node : root.children("Calibration")) {
    const std::string_view part = node.attribute("PartNumber").value();
    if (++count <= 20) known += fmt::format("{}{}", known.empty() ? "" : ", ", Reader::shortened(part));
    if (!chosen && (part_number.empty() || part == part_number)) chosen = node;
  }
  if (count == 0) return reader.error("no calibration in the file", "Calibration", "", "one element");
  if (!chosen) {
    return reader.error("no calibration of that part number", "Calibration", std::string(part_number), known);
  }
  if (part_number.empty() && count > 1) {
    hal::Error error =
        reader.error("the file holds several calibrations", "Calibration", known, "one of them");
    error.remedy = "select one with part_number";
    return error;
  }
  return chosen;
}

hal::Result<std::string> read_file(const std::string& path) {
  std::error_code ignored;
  std::ifstream file;
  if (!std::filesystem::is_fifo(path, ignored))
    file.open(path, std::ios::binary);  // a pipe would block for ever
  std::string text(kMaxFile + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!file && file.gcount() == 0) {
    return hal::Error::of(hal::ErrorCode::kUnreadable, "cannot read the calibration file", path, "",
                          "the .cal file of the sensor", "check path and permissions");
  }
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kMaxFile) {
    return hal::Error::of(hal::ErrorCode::kTooLong, "the file is too large for a calibration", path,
                          "more than 1 MiB", "at most 1 MiB", "take the .cal file of the sensor");
  }
  return text;
}

}  // namespace

hal::Result<Calibration> parse_calibration(std::string_view text, const std::string& source,
                                           std::string_view part_number) {
  const Reader reader("calibration '" + source + "'");
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(text.data(), text.size());
  if (!parsed) {
    return reader.error("not XML", "", fmt::format("byte {}: {}", parsed.offset, parsed.description()),
                        "a .cal file");
  }
  const pugi::xml_node root = document.document_element();
  if (std::string_view(root.name()) != "FTSensor") {
    return reader.error("the root is not FTSensor", "", Reader::shortened(root.name()), "FTSensor");
  }
  auto gauges = reader.number(root, "NumGages", "FTSensor", std::nullopt);
  if (!gauges) return gauges.error();
  if (*gauges != static_cast<double>(kGauges)) {
    return reader.error("NumGages is not that of a six-axis sensor", "FTSensor", fmt::format("{}", *gauges),
                        "6");
  }
  auto version = reader.text(root, "CalFileVersion", "FTSensor");
  if (!version) return version.error();
  if (*version != "1.0" && *version != "1.1") {
    return reader.error("CalFileVersion is unknown", "FTSensor", Reader::shortened(*version), "1.0, 1.1");
  }

  auto chosen = choose(reader, root, part_number);
  if (!chosen) return chosen.error();
  const pugi::xml_node& node = *chosen;
  auto newton = reader.unit(node, "ForceUnits", "Calibration", kForceUnits);
  if (!newton) return newton.error();
  auto newton_mm = reader.unit(node, "TorqueUnits", "Calibration", kTorqueUnits);
  if (!newton_mm) return newton_mm.error();
  auto range_v = reader.number(node, "OutputRange", "Calibration", std::nullopt);
  if (!range_v) return range_v.error();
  if (!(*range_v > 0.0 && *range_v <= 1000.0)) {
    return reader.error("OutputRange is out of range", "Calibration", fmt::format("{}", *range_v),
                        "0 … 1000 V");
  }
  auto bipolar = reader.text(node, "OutputBipolar", "Calibration");
  if (!bipolar) return bipolar.error();
  const bool is_bipolar = *bipolar == "True" || *bipolar == "true" || *bipolar == "1";
  if (!is_bipolar && *bipolar != "False" && *bipolar != "false" && *bipolar != "0") {
    return reader.error("OutputBipolar is neither True nor False", "Calibration", Reader::shortened(*bipolar),
                        "True, False");
  }

  const bool from_user = *version == "1.1";
  const char* const element = from_user ? "UserAxis" : "Axis";
  auto axes = read_axes(reader, node, element, !from_user);
  if (!axes) return axes.error();
  Matrix6 matrix = axes->rows;
  matrix.topRows<3>() *= *newton;
  matrix.bottomRows<3>() *= *newton_mm;
  if (!from_user) {
    auto transform = read_transform(reader, node);
    if (!transform) return transform.error();
    matrix = *transform * matrix;
  }
  if (auto error = check_matrix(reader, matrix, element)) return *error;

  Calibration calibration;
  calibration.serial = Reader::shortened(root.attribute("Serial").value());
  calibration.body_style = Reader::shortened(root.attribute("BodyStyle").value());
  calibration.part_number = Reader::shortened(node.attribute("PartNumber").value());
  calibration.file_version = *version;
  calibration.output_low_v = is_bipolar ? -0.5 * *range_v : 0.0;
  calibration.output_high_v = is_bipolar ? 0.5 * *range_v : *range_v;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto r = static_cast<Eigen::Index>(i);
    calibration.max_load[i] = axes->max_load[r] * (i < 3 ? *newton : *newton_mm);
    for (std::size_t j = 0; j < kGauges; ++j)
      calibration.matrix[i][j] = matrix(r, static_cast<Eigen::Index>(j));
  }
  if (node.child("BiasSlope") || node.child("GainSlope") || node.child("Thermistor")) {
    calibration.notes.emplace_back(
        "the calibration describes temperature compensation in software, which is not applied; bias the "
        "sensor "
        "when it has warmed up");
  }
  return calibration;
}

hal::Result<Calibration> load_calibration(const std::string& path, std::string_view part_number) {
  auto text = read_file(path);
  if (!text) return text.error();
  return parse_calibration(*text, path, part_number);
}

}  // namespace hapticd::daq
