#include "hal/netft/rdt_status.h"

#include <gtest/gtest.h>

namespace hapticd::netft {
namespace {

TEST(RdtStatus, ALatchedConditionIsAWarningOnlyAndSaturationNoFault) {
  struct Case {
    std::uint32_t status;
    bool saturated, warning;
    std::size_t lines;
  };
  for (const Case& c : {Case{0, false, false, 0}, Case{0x8001'0000U, false, true, 1},
                        Case{0x0001'0000U, false, true, 1}, Case{0x8002'0000U, true, false, 1}}) {
    const RdtFitness fitness = judge_rdt_status(c.status);
    EXPECT_FALSE(fitness.faulty) << c.status;
    EXPECT_EQ(fitness.saturated, c.saturated) << c.status;
    EXPECT_EQ(fitness.warning, c.warning) << c.status;
    EXPECT_EQ(describe_rdt_status(c.status).size(), c.lines) << c.status;
  }
}

TEST(RdtStatus, EveryOtherBitIsAFaultWhetherDocumentedOrNot) {
  for (unsigned bit = 0; bit < 31; ++bit) {
    if (bit == 16 || bit == 17) continue;
    const std::uint32_t alone = std::uint32_t{1} << bit;
    for (const std::uint32_t status : {alone, alone | 0x8000'0000U, alone | 0x8003'0000U}) {
      EXPECT_TRUE(judge_rdt_status(status).faulty) << bit;
    }
    const auto lines = describe_rdt_status(alone | 0x8000'0000U);
    ASSERT_EQ(lines.size(), 1U) << bit;
    EXPECT_NE(lines[0].find("(status bit " + std::to_string(bit) + "): "), std::string::npos) << lines[0];
  }
  EXPECT_TRUE(judge_rdt_status(0x8000'0000U).faulty);
  EXPECT_EQ(describe_rdt_status(0x8000'0000U).size(), 1U);
}

TEST(RdtStatus, TellsAllThatIsSet) {
  const auto lines = describe_rdt_status(0x8802'0004U);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_NE(lines[0].find("serial link"), std::string::npos);
  EXPECT_NE(lines[1].find("saturated"), std::string::npos);
  EXPECT_NE(lines[2].find("temperature"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::netft
