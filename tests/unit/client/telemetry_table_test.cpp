#include "client/cpp/telemetry_table.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <string>

#include "client/cpp/error.h"

namespace hapticd::client {
namespace {

v1::TelemetryBlock block_of(std::initializer_list<std::uint64_t> cells, bool first = true) {
  v1::TelemetryBlock block;
  if (first) {
    const auto add = [&](const char* name, v1::ColumnType type) {
      v1::TelemetryColumn* column = block.add_columns();
      column->set_name(name);
      column->set_unit("1");
      column->set_type(type);
    };
    add("tick", v1::COLUMN_TYPE_INT64);
    add("control_hand_force_n", v1::COLUMN_TYPE_FLOAT64);
  }
  std::string& rows = *block.mutable_rows();
  for (const std::uint64_t cell : cells) {
    for (int i = 0; i < 8; ++i) rows += static_cast<char>(cell >> (8 * i) & 0xff);
  }
  return block;
}

std::string refusal_of(TelemetryTable& table, const v1::TelemetryBlock& block) {
  try {
    table.set(block);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUnreadable);
    return error.what();
  }
  return "";
}

TEST(TelemetryTable, ReadsRowsOfSeveralBlocksByTheColumnsOfTheFirst) {
  TelemetryTable table;
  table.set(block_of({7, std::bit_cast<std::uint64_t>(-1.25), 9'007'199'254'740'993,
                      std::bit_cast<std::uint64_t>(std::nan(""))}));
  ASSERT_EQ(table.rows(), 2U);
  EXPECT_EQ(table.integer(0, 0), 7);
  EXPECT_EQ(table.number(0, 0), 7.0);
  EXPECT_EQ(table.number(0, 1), -1.25);
  EXPECT_EQ(table.integer(1, 0), 9'007'199'254'740'993) << "no double holds it";
  EXPECT_TRUE(std::isnan(table.number(1, 1)));
  EXPECT_EQ(table.column("control_hand_force_n"), 1U);
  EXPECT_FALSE(table.column("control_hand_force"));
  table.set(block_of({static_cast<std::uint64_t>(-3), 0}, false));
  ASSERT_EQ(table.rows(), 1U);
  EXPECT_EQ(table.integer(0, 0), -3);
}

TEST(TelemetryTable, RefusesWhatIsNoBlockOfItsStream) {
  TelemetryTable table;
  EXPECT_NE(refusal_of(table, block_of({1, 2}, false)).find("no columns"), std::string::npos);
  table.set(block_of({1, 2}));
  EXPECT_NE(refusal_of(table, block_of({1, 2, 3}, false)).find("24 bytes are no multiple"),
            std::string::npos);
  v1::TelemetryBlock others = block_of({});
  others.add_columns()->set_name("more");
  EXPECT_NE(refusal_of(table, others).find("others than"), std::string::npos);
  TelemetryTable fresh;
  v1::TelemetryBlock unknown = block_of({});
  unknown.mutable_columns(1)->set_type(static_cast<v1::ColumnType>(9));
  EXPECT_NE(refusal_of(fresh, unknown).find("control_hand_force_n"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::client
