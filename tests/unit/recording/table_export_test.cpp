#include "server/recording/export/table_export.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>

#include "hal/replay/csv_file.h"
#include "server/recording/recording_output.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

using recording::put;
using test::demand;
using test::value_of;

constexpr int kRows = 10'000;

class TableExport : public testing::Test {
 protected:
  TableExport() {
    const std::vector<recording::Column> columns{{"tick", "1", true},
                                                 {"time_ns", "ns", true},
                                                 {"contact_reaction_force_n", "N", false},
                                                 {"velocity_mm_per_s", "mm/s", false}};
    RecordingSources sources;
    sources.configuration = "[loop]\nrate_hz = 1000\n";
    auto output =
        value_of(RecordingOutput::begin(folder_.path("a.mcap"), columns, sources, {0, 1'000'000'000, 0},
                                        {{"name", "test"},
                                         {"note", "größer"},
                                         {"by", "7"},
                                         {"rate_hz", "1000"},
                                         {"started_unix_ns", "1767225600123456789"}}));
    demand(output.add_metadata("scene", {{"toml", "name = \"tap\"\n"}}));
    for (std::int64_t tick = 0; tick < kRows; tick += 100) {
      std::string rows;
      for (std::int64_t t = tick; t < tick + 100; ++t) {
        put(t, rows);
        put(t * 1'000'000 + 123'456'789, rows);
        put(0.1 * static_cast<double>(t), rows);
        put(t < 5000 ? std::numeric_limits<double>::quiet_NaN() : 1.0 / 3.0, rows);
      }
      output.add_rows(rows);
      if (tick == 5000) {
        recording::Event event;
        event.tick = 5000;
        event.time_ns = 5'123'456'789;
        event.kind = recording::EventKind::kAnnotation;
        event.text = "half, \"way\"";
        output.add_event(event);
      }
      demand(output.close_chunk());
    }
    demand(output.finish({{"reason", "done"}}));
  }

  ExportRequest request(const std::string& out) const {
    ExportRequest wanted;
    wanted.input = folder_.path("a.mcap");
    wanted.output = folder_.path(out);
    wanted.format = out.ends_with(".csv") ? TableFormat::kCsv : TableFormat::kHdf5;
    return wanted;
  }

  const test::TemporaryFolder folder_;
};

TEST_F(TableExport, CsvHasUnitsAndEveryDigit) {
  demand(export_table(request("a.csv")));
  const std::string text = test::file_text(folder_.path("a.csv"));
  EXPECT_NE(text.find("# recording.note: größer\n"), std::string::npos);
  EXPECT_NE(text.find("\ntick,time_s,contact_reaction_force_n,velocity_mm_per_s\n0,0.123456789,0,nan\n"),
            std::string::npos);
  EXPECT_NE(text.find("\n9999,10.122456789,"), std::string::npos);
  EXPECT_NE(text.find("# event at 5.123456789 s, tick 5000, annotation: half, \"way\"\n"), std::string::npos);
  // It is read again by what reads recordings.
  auto file = value_of(replay::CsvFile::open(folder_.path("a.csv")));
  double sum = 0.0;
  const std::vector<std::size_t> force{2};
  demand(file.read_rows(force, [&](std::size_t, std::span<const double> cells) {
    sum += cells[0];
    return std::nullopt;
  }));
  EXPECT_NEAR(sum, 0.1 * 0.5 * kRows * (kRows - 1), 1e-6);
}

TEST_F(TableExport, ColumnsSpanAndDecimationAreThoseAskedFor) {
  ExportRequest wanted = request("a.csv");
  wanted.columns = {"contact_reaction_force_n"};
  wanted.from_s = 1.0;
  wanted.to_s = 2.0;
  wanted.decimation = 100;
  demand(export_table(wanted));
  const std::string text = test::file_text(wanted.output);
  EXPECT_NE(text.find("\ntick,time_s,contact_reaction_force_n\n1000,"), std::string::npos);
  EXPECT_NE(text.find("\n2000,"), std::string::npos);
  EXPECT_EQ(text.find("\n1050,"), std::string::npos);
  EXPECT_EQ(text.find("\n2100,"), std::string::npos);
}

TEST_F(TableExport, WhatCannotBeExportedIsNamed) {
  ExportRequest wanted = request("a.csv");
  wanted.columns = {"contact_reaction_forse_n"};
  auto error = export_table(wanted);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->what, "the recording has no such column");
  EXPECT_EQ(error->value, "contact_reaction_forse_n");
  EXPECT_EQ(error->limit, "tick, time_ns, contact_reaction_force_n, velocity_mm_per_s");
  EXPECT_EQ(error->remedy, "did you mean 'contact_reaction_force_n'?");

  wanted = request("a.csv");
  wanted.from_s = 100.0;
  error = export_table(wanted);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->what, "there is no row in the span");
  EXPECT_EQ(error->limit, "the recording has 0 … 9.999 s");

  for (const auto& [from_s, to_s] :
       {std::pair(-1.0, 0.0), std::pair(2.0, 1.0), std::pair(std::nan(""), 0.0)}) {
    wanted.from_s = from_s;
    wanted.to_s = to_s;
    EXPECT_EQ(export_table(wanted)->what, "the span is none");
  }
  wanted = request("a.h5");
  wanted.input = folder_.write("foreign.mcap", "nothing");
  EXPECT_EQ(export_table(wanted)->what, "this is no MCAP recording");
  for (const char* out : {"no/folder/a.h5", "no/folder/a.csv"}) {
    EXPECT_EQ(export_table(request(out))->what, "the file cannot be written") << out;
  }
}

TEST_F(TableExport, AFullDiskIsNamedAsOne) {
  ExportRequest wanted = request("a.csv");
  wanted.output = "/dev/full";
  const auto error = test::error_of(export_table(wanted));
  EXPECT_EQ(error.code, hal::ErrorCode::kFull) << error.text();
}

TEST_F(TableExport, FollowsALinkOnlyWhereItMay) {
  std::filesystem::create_symlink(request("a.csv").input, folder_.path("link.mcap"));
  ExportRequest wanted = request("a.csv");
  wanted.input = folder_.path("link.mcap");
  EXPECT_FALSE(export_table(wanted));
  wanted.links = recording::Links::kRefused;
  EXPECT_EQ(export_table(wanted)->what, "the recording cannot be opened");
}

TEST_F(TableExport, H5pyReadsTheSameNumbersAndUnits) {
  demand(export_table(request("a.h5")));
  const std::string python = PYTHON_OF_THE_SYSTEM;
  if (std::system((python + " -c 'import h5py' 2>/dev/null").c_str()) != 0) {
    GTEST_SKIP() << "SKIPPED LOUDLY: " << python << " has no h5py (Debian: python3-h5py)";
  }
  const std::string script = folder_.write("check.py", R"(
import sys, h5py, numpy
f = h5py.File(sys.argv[1], "r")
t = f["telemetry"]
assert sorted(t) == ["contact_reaction_force_n", "tick", "time_ns", "time_s", "velocity_mm_per_s"], sorted(t)
assert t["tick"].shape == (10000,) and t["tick"].dtype == numpy.int64
assert (t["tick"][:] == numpy.arange(10000)).all()
assert t["time_ns"][9999] == 9999 * 1000000 + 123456789
assert abs(t["time_s"][9999] - 10.122456789) < 1e-9
assert (t["contact_reaction_force_n"][:] == 0.1 * numpy.arange(10000)).all()
v = t["velocity_mm_per_s"][:]
assert numpy.isnan(v[:5000]).all() and (v[5000:] == 1.0 / 3.0).all()
assert t["contact_reaction_force_n"].attrs["unit"] == "N" and t["time_s"].attrs["unit"] == "s"
assert t["velocity_mm_per_s"].attrs["description"] == "group velocity: mm per s"
assert t["contact_reaction_force_n"].chunks == (4096,) and t["contact_reaction_force_n"].shuffle and t["contact_reaction_force_n"].compression == "gzip"
assert t["contact_reaction_force_n"].dims[0][0].name == "/telemetry/time_s"
assert f.attrs["name"] == "test" and f.attrs["note"] == "größer" and f.attrs["end_reason"] == "done"
assert f.attrs["rate_hz"] == 1000.0 and f.attrs["rate_hz"].dtype == numpy.float64
assert f.attrs["started_unix_ns"] == 1767225600123456789 and f.attrs["started_unix_ns"].dtype == numpy.int64
assert f.attrs["end_rows"] == 10000 and f.attrs["by"] == "7"
assert f["metadata/clock_anchor_unix_ns"][()] == 1000000000
assert f["metadata/scene_toml"].asstr()[()].startswith("name = ")
assert f["metadata/configuration_toml"].asstr()[()].startswith("[loop]")
assert f["events/tick"][:].tolist() == [5000] and f["events/kind"].asstr()[:].tolist() == ["annotation"]
assert f["events/text"].asstr()[0] == 'half, "way"'
)");
  EXPECT_EQ(std::system((python + " " + script + " " + folder_.path("a.h5")).c_str()), 0);
}

/// The rows of a CSV file, without its comments.
std::string rows_of(const std::string& path) {
  std::istringstream lines(test::file_text(path));
  std::string rows;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with('#')) rows += line + '\n';
  }
  return rows;
}

TEST_F(TableExport, AnHdf5TableGivesTheSameRowsAsItsRecording) {
  demand(export_table(request("a.h5")));
  demand(export_table(request("a.csv")));
  ExportRequest again = request("b.csv");
  again.input = folder_.path("a.h5");
  demand(export_table(again));
  const std::string rows = rows_of(folder_.path("b.csv"));
  EXPECT_GT(rows.size(), 100'000U);
  EXPECT_EQ(rows, rows_of(folder_.path("a.csv")));
  again.columns = {"velocity_mm_per_s"};
  again.from_s = 9.0;
  again.decimation = 100;
  demand(export_table(again));
  EXPECT_TRUE(rows_of(again.output).starts_with("tick,time_s,velocity_mm_per_s\n9000,9.123456789,0.333"));
}

TEST_F(TableExport, AnHdf5FileThatIsNotOursIsNamed) {
  demand(export_table(request("a.h5")));
  const std::string whole = test::file_text(folder_.path("a.h5"));
  ExportRequest wanted = request("b.csv");
  wanted.input = folder_.write("cut.h5", whole.substr(0, whole.size() / 2));
  const auto error = test::error_of(export_table(wanted));
  EXPECT_EQ(error.what, "this HDF5 file has no recording of hapticd");
  EXPECT_NE(error.remedy.find("hapticctl record export"), std::string::npos) << error.remedy;
  wanted.input = folder_.path("a.h5");
  wanted.links = recording::Links::kRefused;
  EXPECT_EQ(export_table(wanted)->what, "this is no MCAP recording") << "the daemon reads its own kind only";
}

TEST_F(TableExport, TheExampleOfTheDocumentationReadsBoth) {
  demand(export_table(request("a.h5")));
  demand(export_table(request("a.csv")));
  const std::string python = PYTHON_OF_THE_SYSTEM;
  if (std::system((python + " -c 'import h5py, pandas' 2>/dev/null").c_str()) != 0) {
    GTEST_SKIP() << "SKIPPED LOUDLY: " << python
                 << " has no h5py or no pandas (Debian: python3-h5py python3-pandas)";
  }
  const std::string command = python + " " + SOURCE_FOLDER + "/client/python/examples/read_export.py " +
                              folder_.path("a.h5") + " " + folder_.path("a.csv") + " > " +
                              folder_.path("out");
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(test::file_text(folder_.path("out")),
            "größer: up to 999.9 N in 10.0 s\n5.123 s: half, \"way\"\n10000 rows, the last at 10.122 s\n");
}

}  // namespace
}  // namespace hapticd::server
