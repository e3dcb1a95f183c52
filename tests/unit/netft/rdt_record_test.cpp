#include "hal/netft/rdt_record.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace hapticd::netft {
namespace {

using Records = std::array<RdtRecord, kRdtMostRecords>;

// Written by hand after the manual's table of the record.
const std::vector<std::uint8_t> kRecord{
    0x01, 0x02, 0x03, 0x04,  // RDT sequence
    0xff, 0xff, 0xff, 0xfe,  // F/T sequence
    0x80, 0x01, 0x00, 0x00,  // status
    0x00, 0x0f, 0x42, 0x40,  // Fx 1 000 000
    0xff, 0xf0, 0xbd, 0xc0,  // Fy -1 000 000
    0x00, 0x00, 0x00, 0x01,  // Fz 1
    0x7f, 0xff, 0xff, 0xff,  // Tx
    0x80, 0x00, 0x00, 0x00,  // Ty
    0xff, 0xff, 0xff, 0xff,  // Tz -1
};

TEST(RdtRecord, IsReadBigEndian) {
  Records records;
  ASSERT_EQ(parse_rdt_datagram(kRecord, records), 1U);
  const RdtRecord& r = records[0];
  EXPECT_EQ(r.rdt_sequence, 0x01020304U);
  EXPECT_EQ(r.ft_sequence, 0xfffffffeU);
  EXPECT_EQ(r.status, 0x80010000U);
  EXPECT_EQ(r.force_counts, (std::array<std::int32_t, 3>{1'000'000, -1'000'000, 1}));
  EXPECT_EQ(r.torque_counts, (std::array<std::int32_t, 3>{std::numeric_limits<std::int32_t>::max(),
                                                          std::numeric_limits<std::int32_t>::min(), -1}));
}

TEST(RdtRecord, ADatagramMayHoldSeveral) {
  std::vector<std::uint8_t> bytes;
  for (std::uint8_t i = 0; i < kRdtMostRecords; ++i) {
    bytes.insert(bytes.end(), kRecord.begin(), kRecord.end());
    bytes[i * kRdtRecordBytes + 3] = i;
  }
  Records records;
  ASSERT_EQ(parse_rdt_datagram(bytes, records), kRdtMostRecords);
  for (std::size_t i = 0; i < kRdtMostRecords; ++i) EXPECT_EQ(records[i].rdt_sequence, 0x01020300U + i);
}

TEST(RdtRecord, RefusesEveryLengthThatIsNoWholeNumberOfRecords) {
  std::vector<std::uint8_t> bytes((kRdtMostRecords + 2) * kRdtRecordBytes);
  Records records;
  for (std::size_t length = 0; length <= bytes.size(); ++length) {
    const std::size_t whole = length / kRdtRecordBytes;
    const bool fits = length % kRdtRecordBytes == 0 && whole <= kRdtMostRecords;
    EXPECT_EQ(parse_rdt_datagram(std::span(bytes).first(length), records), fits ? whole : 0) << length;
  }
}

TEST(RdtRequest, IsEightBytesBigEndian) {
  EXPECT_EQ(rdt_request(RdtCommand::kStartRealTime),
            (std::array<std::uint8_t, 8>{0x12, 0x34, 0x00, 0x02, 0, 0, 0, 0}));
  EXPECT_EQ(rdt_request(RdtCommand::kSetSoftwareBias),
            (std::array<std::uint8_t, 8>{0x12, 0x34, 0x00, 0x42, 0, 0, 0, 0}));
  EXPECT_EQ(rdt_request(RdtCommand::kStop, 0x01020304),
            (std::array<std::uint8_t, 8>{0x12, 0x34, 0x00, 0x00, 1, 2, 3, 4}));
}

}  // namespace
}  // namespace hapticd::netft
