// The file of a recording: what is written is read, and what was cut anywhere is read up to its last whole
// chunk.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "hal/recording/mcap_reader.h"
#include "hal/recording/mcap_writer.h"
#include "hal/recording/recording_file.h"
#include "hal/recording/recording_names.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::recording {
namespace {

using test::demand;
using test::value_of;

constexpr int kChunks = 4;
constexpr int kRowsPerChunk = 25;

const std::vector<Column>& columns() {
  static const std::vector<Column> kColumns{
      {"tick", "1", true}, {"time_ns", "ns", true}, {"force_z_n", "N", false}};
  return kColumns;
}

std::string rows_from(std::int64_t first, int count) {
  std::string rows;
  for (std::int64_t tick = first; tick < first + count; ++tick) {
    put(tick, rows);
    put(tick * 1'000'000, rows);
    put(0.5 * static_cast<double>(tick), rows);
  }
  return rows;
}

/// Four chunks of 25 rows and an event each, not finished.
McapWriter begun(const std::string& path) {
  McapWriter writer = value_of(McapWriter::begin(value_of(AppendFile::create(path)), "test"));
  const auto block = value_of(writer.add_schema(kBlockSchema, "protobuf", "schema"));
  const auto event = value_of(writer.add_schema(kEventSchema, "protobuf", "schema"));
  const auto telemetry = value_of(writer.add_channel(block, kTelemetryTopic, "protobuf", {}));
  const auto events = value_of(writer.add_channel(event, kEventTopic, "protobuf", {}));
  demand(writer.add_metadata(kStartMetadata, {{"name", "test"}}));
  for (int chunk = 0; chunk < kChunks; ++chunk) {
    const std::int64_t first = chunk * kRowsPerChunk;
    const std::string data = block_message(describe(columns()), rows_from(first, kRowsPerChunk));
    const auto time = static_cast<std::uint64_t>(1000 + first);
    writer.add_message({telemetry, static_cast<std::uint32_t>(chunk), time, time, data});
    Event note;
    note.tick = static_cast<std::uint64_t>(first);
    note.kind = EventKind::kAnnotation;
    note.text = "chunk " + std::to_string(chunk);
    const std::string text = event_message(note);
    writer.add_message({events, static_cast<std::uint32_t>(chunk), time, time, text});
    demand(writer.close_chunk());
  }
  return writer;
}

struct Seen {
  std::vector<std::int64_t> ticks;
  std::vector<std::string> notes;
  std::map<std::string, Texts> metadata;
  McapEnd end;
};

Seen read_all(const std::string& path) {
  Seen seen;
  const RecordingFile file = value_of(RecordingFile::open(path));
  RecordingVisitor visitor;
  visitor.row = [&](const Row& row) {
    EXPECT_EQ(row.integer(1), row.integer(0) * 1'000'000);
    EXPECT_EQ(row.number(2), 0.5 * static_cast<double>(row.integer(0)));
    seen.ticks.push_back(row.integer(0));
    return true;
  };
  visitor.event = [&](const Event& event) { seen.notes.push_back(event.text); };
  visitor.metadata = [&](const std::string& name, const Texts& texts) { seen.metadata[name] = texts; };
  seen.end = value_of(file.read(visitor));
  return seen;
}

TEST(Mcap, WhatIsWrittenIsRead) {
  const test::TemporaryFolder folder(test::memory_folder());
  const std::string path = folder.path("a.mcap");
  {
    McapWriter writer = begun(path);
    demand(writer.finish());
  }
  const Seen seen = read_all(path);
  ASSERT_EQ(seen.ticks.size(), static_cast<std::size_t>(kChunks * kRowsPerChunk));
  for (std::size_t i = 0; i < seen.ticks.size(); ++i) EXPECT_EQ(seen.ticks[i], static_cast<std::int64_t>(i));
  EXPECT_EQ(seen.notes, (std::vector<std::string>{"chunk 0", "chunk 1", "chunk 2", "chunk 3"}));
  EXPECT_EQ(seen.metadata.at(kStartMetadata).at("name"), "test");
  EXPECT_TRUE(seen.end.is_finished);
  EXPECT_EQ(seen.end.damage, "");

  const McapReader reader = value_of(McapReader::open(path));
  const auto summary = reader.summary();
  ASSERT_TRUE(summary.has_value());
  EXPECT_EQ(summary->message_count, 2U * kChunks);
  EXPECT_EQ(summary->chunks.size(), static_cast<std::size_t>(kChunks));
  EXPECT_EQ(summary->start_time_ns, 1000U);
  EXPECT_EQ(summary->end_time_ns, 1075U);
  ASSERT_EQ(summary->metadata.size(), 1U);
  EXPECT_EQ(reader.metadata(summary->metadata[0])->at("name"), "test");
}

TEST(Mcap, AFileThatIsCutAnywhereIsReadToItsLastWholeChunkAndRepaired) {
  const test::TemporaryFolder folder(test::memory_folder());
  const std::string whole = folder.path("whole.mcap");
  std::vector<std::uint64_t> chunk_ends;
  {
    McapWriter writer = begun(whole);
    for (const ChunkIndex& chunk : writer.content().chunks) chunk_ends.push_back(chunk.offset + chunk.length);
    demand(writer.finish());
  }
  const std::string bytes = test::file_text(whole);
  std::size_t unreadable = 0;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const std::string path = folder.write("cut.mcap", bytes.substr(0, size));
    const auto whole_chunks = static_cast<std::size_t>(
        std::count_if(chunk_ends.begin(), chunk_ends.end(), [&](std::uint64_t end) { return end <= size; }));
    if (whole_chunks == 0) {
      EXPECT_FALSE(RecordingFile::open(path)) << size;
      if (size >= kMagic.size()) {
        EXPECT_TRUE(repair(path)) << size;
      }
      continue;
    }
    const Seen cut = read_all(path);
    EXPECT_EQ(cut.ticks.size(), whole_chunks * kRowsPerChunk) << size;
    EXPECT_FALSE(cut.end.is_finished) << size;

    const auto repaired = repair(path);
    if (!repaired || !*repaired) ++unreadable;
    const Seen again = read_all(path);
    EXPECT_EQ(again.ticks.size(), whole_chunks * kRowsPerChunk) << size;
    EXPECT_TRUE(again.end.is_finished) << size;
    const auto summary = value_of(McapReader::open(path)).summary();
    ASSERT_TRUE(summary.has_value()) << size;
    EXPECT_EQ(summary->message_count, 2 * whole_chunks) << size;
    for (const ChunkIndex& chunk : summary->chunks) EXPECT_EQ(chunk.message_index_offsets.size(), 2U) << size;
    EXPECT_EQ(again.metadata.at(kEndMetadata).at("repaired"), "true");
  }
  EXPECT_EQ(unreadable, 0U);
}

TEST(Mcap, ADamagedByteNeverCrashesAReaderAndIsFound) {
  const test::TemporaryFolder folder(test::memory_folder());
  const std::string path = folder.path("a.mcap");
  std::uint64_t data_end = 0;
  {
    McapWriter writer = begun(path);
    data_end = writer.content().end;
    demand(writer.finish());
  }
  const std::string bytes = test::file_text(path);
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x5a);
    const std::string other = folder.write("damaged.mcap", damaged);
    const auto file = RecordingFile::open(other);
    if (!file) continue;
    std::size_t rows = 0;
    RecordingVisitor visitor;
    visitor.row = [&](const Row& row) {
      EXPECT_EQ(row.number(2), 0.5 * static_cast<double>(row.integer(0)))
          << "a wrong value is shown, byte " << at;
      ++rows;
      return true;
    };
    const auto end = value_of(file->read(visitor));
    if (rows < static_cast<std::size_t>(kChunks * kRowsPerChunk) && at < data_end) {
      EXPECT_FALSE(end.damage.empty()) << at;
    }
  }
}

TEST(Mcap, RepairingAFinishedFileChangesNothing) {
  const test::TemporaryFolder folder(test::memory_folder());
  const std::string path = folder.path("a.mcap");
  {
    McapWriter writer = begun(path);
    demand(writer.finish());
  }
  const std::string before = test::file_text(path);
  EXPECT_FALSE(value_of(repair(path)));
  EXPECT_EQ(test::file_text(path), before);
}

TEST(Mcap, AFileThatIsBeingWrittenIsNotRepaired) {
  const test::TemporaryFolder folder(test::memory_folder());
  const std::string path = folder.path("a.mcap");
  const McapWriter writer = begun(path);
  EXPECT_EQ(test::error_of(repair(path)).what, "another process writes this file");
}

TEST(Mcap, ADroppedChunkLeavesAWholeFile) {
  const test::TemporaryFolder folder(test::memory_folder());
  const std::string path = folder.path("a.mcap");
  {
    McapWriter writer = begun(path);
    ASSERT_TRUE(writer.drop_last_chunk());
    demand(writer.finish());
  }
  const Seen seen = read_all(path);
  EXPECT_EQ(seen.ticks.size(), static_cast<std::size_t>((kChunks - 1) * kRowsPerChunk));
  EXPECT_TRUE(seen.end.is_finished);
  EXPECT_EQ(value_of(McapReader::open(path)).summary()->message_count, 2U * (kChunks - 1));
}

TEST(Mcap, ForeignFilesAreRefusedWithTheirName) {
  const test::TemporaryFolder folder(test::memory_folder());
  for (const std::string& content : {std::string(), std::string("time_s,force_N\n"), std::string(kMagic)}) {
    const std::string path = folder.write("foreign.mcap", content);
    EXPECT_NE(test::error_of(RecordingFile::open(path)).where.find(path), std::string::npos);
  }
  EXPECT_FALSE(RecordingFile::open(folder.path("none.mcap")));
  EXPECT_FALSE(RecordingFile::open(folder.path()));
}

}  // namespace
}  // namespace hapticd::recording
