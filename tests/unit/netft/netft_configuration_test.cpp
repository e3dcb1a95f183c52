#include "hal/netft/netft_configuration.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/support/value_of.h"

namespace hapticd::netft {
namespace {

// As a box with a Nano17 writes it, shortened.
const std::string kPage = R"(<?xml version="1.0"?><netft>
<runstat>0x80010000</runstat><runft>-77;12;0;1;2;3</runft><runrate>7000</runrate>
<cfgnam>probe</cfgnam><cfgcalsel>0</cfgcalsel><cfgcalsn>FT12345</cfgcalsn>
<scfgfu>N</scfgfu><scfgtu>Nmm</scfgtu>
<cfgtfx>0;0;0;0;0;0</cfgtfx><scfgtdu>mm</scfgtdu>
<cfgcpf>1000000</cfgcpf><cfgcpt>250000</cfgcpt>
<cfgmr>25;25;35;250;250;250</cfgmr>
<setbias>745;17;447;184;-596;-253</setbias><setuserfilter>1</setuserfilter>
<comrdte>Enabled</comrdte><comrdtrate>7000</comrdtrate><comrdtbsiz>1</comrdtbsiz>
<mfgdigver>2.2.59</mfgdigver><prodname>Net F/T</prodname>
</netft>)";

std::string with(const std::string& element, const std::string& value) {
  std::string page = kPage;
  const std::size_t begin = page.find("<" + element + ">") + element.size() + 2;
  return page.replace(begin, page.find("</" + element + ">") - begin, value);
}

std::string without(const std::string& element) {
  std::string page = kPage;
  const std::size_t begin = page.find("<" + element + ">");
  const std::size_t end = page.find("</" + element + ">") + element.size() + 3;
  return page.erase(begin, end - begin);
}

TEST(NetFtConfiguration, IsRead) {
  const auto box = test::value_of(parse_netft_configuration(kPage, "page"));
  EXPECT_EQ(box.product, "Net F/T");
  EXPECT_EQ(box.firmware, "2.2.59");
  EXPECT_EQ(box.calibration_serial, "FT12345");
  EXPECT_DOUBLE_EQ(box.newtons_per_count, 1e-6);
  EXPECT_DOUBLE_EQ(box.newton_millimetres_per_count, 4e-6);
  EXPECT_EQ(box.ranges, (std::array<double, 6>{25, 25, 35, 250, 250, 250}));
  EXPECT_EQ(box.bias, (std::array<double, 6>{745, 17, 447, 184, -596, -253}));
  EXPECT_EQ(box.low_pass_hz, 838.0);
  EXPECT_EQ(box.rdt_enabled, true);
  EXPECT_EQ(box.rdt_rate_hz, 7000.0);
  EXPECT_EQ(box.records_per_datagram, 1);
  EXPECT_EQ(box.status, 0x8001'0000U);
}

TEST(NetFtConfiguration, UnitsScaleCountsAndRanges) {
  std::string page = with("scfgfu", " lbf ");
  const std::string torque = "<scfgtu>Nmm</scfgtu>";
  page.replace(page.find(torque), torque.size(), "<scfgtu>lbf-in</scfgtu>");
  const auto box = test::value_of(parse_netft_configuration(page, "page"));
  EXPECT_DOUBLE_EQ(box.newtons_per_count, 4.4482216152605e-6);
  EXPECT_DOUBLE_EQ(box.newton_millimetres_per_count, 25.4 * 4.4482216152605 / 250000.0);
  EXPECT_DOUBLE_EQ((*box.ranges)[2], 35.0 * 4.4482216152605);
  EXPECT_DOUBLE_EQ((*box.ranges)[5], 250.0 * 25.4 * 4.4482216152605);
}

TEST(NetFtConfiguration, UnitsMayBeGivenByNumber) {
  std::string page = without("scfgfu");
  page.insert(page.find("<cfgcpf>"), "<cfgfu>5</cfgfu>");
  const auto box = test::value_of(parse_netft_configuration(page, "page"));
  EXPECT_DOUBLE_EQ(box.newtons_per_count, 9.80665e-6);
}

TEST(NetFtConfiguration, ListsMayBeSeparatedOtherwise) {
  for (const char* list : {"1,2,3,4,5,6", "1 2 3 4 5 6", "1; 2; 3; 4; 5; 6;", " 1.0;2;3;4;5;6 "}) {
    const auto box = parse_netft_configuration(with("setbias", list), "page");
    ASSERT_TRUE(box) << list;
    EXPECT_EQ(box->bias, (std::array<double, 6>{1, 2, 3, 4, 5, 6})) << list;
  }
}

TEST(NetFtConfiguration, WhatIsNotRequiredMayBeAbsent) {
  const auto box = test::value_of(parse_netft_configuration(
      "<x><cfgcpf>1e6</cfgcpf><cfgcpt>1e6</cfgcpt><scfgfu>N</scfgfu><scfgtu>N-m</scfgtu></x>", "page"));
  EXPECT_DOUBLE_EQ(box.newton_millimetres_per_count, 1e-3);
  EXPECT_FALSE(box.ranges || box.bias || box.low_pass_hz || box.rdt_enabled || box.rdt_rate_hz ||
               box.status || box.tool_transformation);
}

TEST(NetFtConfiguration, WhatIsRequiredIsNamedWhenItIsAbsent) {
  for (const char* element : {"cfgcpf", "cfgcpt", "scfgfu", "scfgtu"}) {
    const auto box = parse_netft_configuration(without(element), "page");
    ASSERT_FALSE(box) << element;
    EXPECT_EQ(box.error().where, std::string("page, element '") + element + "'");
    EXPECT_EQ(box.error().what, "the element is missing");
  }
}

TEST(NetFtConfiguration, EveryWrongValueIsRefusedByItsElement) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"cfgcpf", "0"},
      {"cfgcpf", "-1"},
      {"cfgcpf", "nan"},
      {"cfgcpf", "inf"},
      {"cfgcpf", "1e400"},
      {"cfgcpf", "12x"},
      {"cfgcpf", ""},
      {"cfgcpt", "1e13"},
      {"scfgfu", "newton"},
      {"scfgfu", ""},
      {"scfgtu", "N"},
      {"cfgmr", "1;2;3;4;5"},
      {"cfgmr", "1;2;3;4;5;6;7"},
      {"cfgmr", "1;2;3;4;5;x"},
      {"setbias", "1;2;3;4;5;nan"},
      {"setuserfilter", "13"},
      {"setuserfilter", "-1"},
      {"setuserfilter", "1.5"},
      {"comrdte", "perhaps"},
      {"comrdtrate", "0"},
      {"comrdtrate", "fast"},
      {"comrdtbsiz", "41"},
      {"runstat", "0x1234567890"},
      {"runstat", "fine"},
      {"cfgtfx", "1;2"},
  };
  for (const auto& [element, value] : cases) {
    const auto box = parse_netft_configuration(with(element, value), "page");
    ASSERT_FALSE(box) << element << " = " << value;
    EXPECT_EQ(box.error().where, "page, element '" + element + "'") << value;
    EXPECT_FALSE(box.error().limit.empty());
    EXPECT_FALSE(box.error().remedy.empty());
    EXPECT_NE(box.error().value.find(value.substr(0, 8)), std::string::npos);
  }
}

TEST(NetFtConfiguration, WhatIsNoXmlIsRefused) {
  for (const char* text : {"", "404", "<netft><cfgcpf>1", "<a></b>", "{\"cfgcpf\": 1}"}) {
    EXPECT_FALSE(parse_netft_configuration(text, "page")) << text;
  }
  EXPECT_FALSE(parse_netft_configuration(std::string(kMaxPageBytes + 1, ' '), "page"));
  // Every beginning of a page is some page that was cut off.
  for (std::size_t length = 0; length < kPage.size() - 8; ++length) {
    EXPECT_FALSE(parse_netft_configuration(std::string_view(kPage).substr(0, length), "page")) << length;
  }
}

TEST(NetFtConfiguration, ShowsNoControlCharactersInErrors) {
  const auto box = parse_netft_configuration(with("comrdtrate", "\x1b[2J" + std::string(200, 'x')), "page");
  ASSERT_FALSE(box);
  EXPECT_EQ(box.error().value.find('\x1b'), std::string::npos);
  EXPECT_LT(box.error().value.size(), 80U);
}

}  // namespace
}  // namespace hapticd::netft
