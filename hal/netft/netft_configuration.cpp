#include "hal/netft/netft_configuration.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <pugixml.hpp>
#include <utility>

#include "hal/netft/netft_units.h"
#include "hal/shown_text.h"

namespace hapticd::netft {

namespace {

using hal::shown;
using hal::trimmed;

constexpr double kMaxCounts = 1e12;
constexpr double kFastestHz = 100'000.0;
constexpr double kMaxReading = 1e9;
/// Units by their numbers in cfgfu and cfgtu, for firmware that does not give names.
constexpr std::array<std::string_view, 6> kForceUnitByCode{"lbf", "N", "klbf", "kN", "kgf", "gf"};
constexpr std::array<std::string_view, 6> kTorqueUnitByCode{"lbf-in", "lbf-ft", "Nm", "Nmm", "kgf-cm", "kNm"};

bool read_number(std::string_view text, double& number) {
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number);
  return code == std::errc() && end == text.data() + text.size() && std::isfinite(number);
}

/// The page's elements by name; keeps the first error.
class Page {
 public:
  Page(const pugi::xml_document& document, std::string_view where) : document_(document), where_(where) {}

  const std::optional<hal::Error>& error() const { return error_; }

  std::optional<std::string_view> text(const char* name) {
    const pugi::xml_node node = find(name);
    if (!node) return std::nullopt;
    return trimmed(node.text().get());
  }

  std::optional<double> number(const char* name, double least, double most, const std::string& limit) {
    const auto value = text(name);
    if (!value) return std::nullopt;
    double read = 0.0;
    if (!read_number(*value, read) || read < least || read > most) {
      refuse(name, *value, limit);
      return std::nullopt;
    }
    return read;
  }

  double required_counts(const char* name) {
    const auto counts = number(name, 1e-6, kMaxCounts, "more than 0, at most 1e12 counts per unit");
    if (!counts && !error_) missing(name);
    return counts.value_or(1.0);
  }

  /// Six numbers separated by semicolons, commas or blanks: firmware versions differ.
  std::optional<std::array<double, 6>> six(const char* name) {
    const auto value = text(name);
    if (!value) return std::nullopt;
    constexpr std::string_view kSeparators = ";, \t\r\n";
    std::array<double, 6> read{};
    std::size_t count = 0;
    std::string_view rest = *value;
    for (;;) {
      const std::size_t begin = rest.find_first_not_of(kSeparators);
      if (begin == std::string_view::npos) break;
      rest.remove_prefix(begin);
      const std::string_view cell = rest.substr(0, rest.find_first_of(kSeparators));
      double number = 0.0;
      if (count == read.size() || !read_number(cell, number) || std::abs(number) > kMaxReading) {
        count = 0;
        break;
      }
      read[count++] = number;
      rest.remove_prefix(cell.size());
    }
    if (count != read.size()) {
      refuse(name, *value, "six numbers separated by ';'");
      return std::nullopt;
    }
    return read;
  }

  /// Unit by its name, or by its number if the firmware gives only that.
  std::string unit(const char* name, const char* code_name, const std::array<std::string_view, 6>& by_code) {
    if (const auto value = text(name)) return std::string(*value);
    const auto code = number(code_name, 1.0, 6.0, "1 … 6");
    if (code && *code == std::floor(*code)) return std::string(by_code[static_cast<std::size_t>(*code) - 1]);
    if (!error_) missing(name);
    return {};
  }

  std::string place(const char* name) const { return std::string(where_) + ", element '" + name + "'"; }

  void keep(hal::Error error) {
    if (!error_) error_ = std::move(error);
  }
  void refuse(const char* name, std::string_view value, std::string limit) {
    keep({.what = "the value cannot be used",
          .where = place(name),
          .value = shown(value),
          .limit = std::move(limit),
          .remedy = "check the box's settings and its firmware"});
  }

 private:
  void missing(const char* name) {
    keep({.what = "the element is missing",
          .where = place(name),
          .value = {},
          .limit = "a page with cfgcpf, cfgcpt, scfgfu and scfgtu",
          .remedy = "check that the address is that of a Net F/T box, or set read_configuration = false and "
                    "set counts and units by hand"});
  }
  pugi::xml_node find(const char* name) {
    return document_.find_node([name](const pugi::xml_node& node) {
      return node.type() == pugi::node_element && std::strcmp(node.name(), name) == 0;
    });
  }

  const pugi::xml_document& document_;
  std::string_view where_;
  std::optional<hal::Error> error_;
};

std::optional<bool> read_flag(Page& page, const char* name) {
  const auto value = page.text(name);
  if (!value) return std::nullopt;
  for (const std::string_view yes : {"Enabled", "enabled", "1"}) {
    if (*value == yes) return true;
  }
  for (const std::string_view no : {"Disabled", "disabled", "0"}) {
    if (*value == no) return false;
  }
  page.refuse(name, *value, "Enabled or Disabled");
  return std::nullopt;
}

std::optional<std::uint32_t> read_hexadecimal(Page& page, const char* name) {
  const auto value = page.text(name);
  if (!value) return std::nullopt;
  std::string_view digits = *value;
  if (digits.starts_with("0x") || digits.starts_with("0X")) digits.remove_prefix(2);
  std::uint32_t number = 0;
  const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), number, 16);
  if (code == std::errc() && end == digits.data() + digits.size()) return number;
  page.refuse(name, *value, "up to eight hexadecimal digits after 0x");
  return std::nullopt;
}

std::optional<double> read_low_pass(Page& page) {
  const char* name = "setuserfilter";
  const auto number = page.number(name, 0.0, static_cast<double>(kLowPassHz.size()) - 1.0, "0 … 12");
  if (!number) return std::nullopt;
  if (*number != std::floor(*number)) {
    page.refuse(name, *page.text(name), "a whole number, 0 … 12");
    return std::nullopt;
  }
  return kLowPassHz[static_cast<std::size_t>(*number)];
}

}  // namespace

hal::Result<BoxConfiguration> parse_netft_configuration(std::string_view xml, std::string_view where) {
  if (xml.size() > kMaxPageBytes) {
    return hal::Error{.what = "the page is too long for a box's configuration",
                      .where = std::string(where),
                      .value = std::to_string(xml.size()) + " bytes",
                      .limit = "at most " + std::to_string(kMaxPageBytes) + " bytes",
                      .remedy = "check address and path"};
  }
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(xml.data(), xml.size());
  if (!parsed) {
    return hal::Error{.what = std::string("the page is not XML: ") + parsed.description(),
                      .where = std::string(where) + ", byte " + std::to_string(parsed.offset),
                      .value = shown(xml.substr(0, 60)),
                      .limit = "the XML page /netftapi2.xml of a Net F/T box",
                      .remedy = "check address and path"};
  }

  Page page(document, where);
  BoxConfiguration box;
  box.product = page.text("prodname").value_or("");
  box.firmware = page.text("mfgdigver").value_or("");
  box.calibration_serial = page.text("cfgcalsn").value_or("");
  const double counts_per_force = page.required_counts("cfgcpf");
  const double counts_per_torque = page.required_counts("cfgcpt");
  box.force_unit = page.unit("scfgfu", "cfgfu", kForceUnitByCode);
  box.torque_unit = page.unit("scfgtu", "cfgtu", kTorqueUnitByCode);
  if (page.error()) return *page.error();
  const auto newtons = newtons_per(box.force_unit, page.place("scfgfu"));
  if (!newtons) return newtons.error();
  const auto newton_millimetres = newton_millimetres_per(box.torque_unit, page.place("scfgtu"));
  if (!newton_millimetres) return newton_millimetres.error();
  box.newtons_per_count = *newtons / counts_per_force;
  box.newton_millimetres_per_count = *newton_millimetres / counts_per_torque;

  box.ranges = page.six("cfgmr");
  if (box.ranges) {
    for (std::size_t i = 0; i < 6; ++i) (*box.ranges)[i] *= i < 3 ? *newtons : *newton_millimetres;
  }
  box.bias = page.six("setbias");
  box.tool_transformation = page.six("cfgtfx");
  box.low_pass_hz = read_low_pass(page);
  box.rdt_enabled = read_flag(page, "comrdte");
  box.rdt_rate_hz = page.number("comrdtrate", 1.0, kFastestHz, "1 … 100000 Hz");
  const auto records = page.number("comrdtbsiz", 1.0, 40.0, "1 … 40 records");
  if (records) box.records_per_datagram = static_cast<int>(*records);
  box.status = read_hexadecimal(page, "runstat");
  if (page.error()) return *page.error();
  return box;
}

}  // namespace hapticd::netft
