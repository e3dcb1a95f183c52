#include <exception>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "tests/measure/bench/benchmark.h"
#include "tests/measure/bench/decode/block_decode.h"
#include "tests/measure/report/report.h"

namespace hapticd::bench {
namespace {

/// Batches as a live view takes them, and those of a client that takes everything.
constexpr unsigned kLiveBatch = 20;
constexpr unsigned kBulkBatch = 100;

using AddFigure = std::function<void(const std::string& name, const report::Figure& figure)>;

/// Measures one language, with batches of this size at 1 kHz.
void add_decode_cost(const std::filesystem::path& folder, double seconds, bool python, unsigned batch_size,
                     const AddFigure& add) {
  const char* language = python ? "python" : "cpp";
  const std::string size = std::to_string(batch_size);
  DecodeCost cost;
  std::string failed;
  try {
    const RecordedBatches batches(folder / (language + size), seconds, batch_size);
    cost = python ? batches.decoded_in_python() : batches.decoded_in_cpp();
  } catch (const std::exception& error) {
    failed = error.what();
  }
  for (const bool blocks : {false, true}) {
    const char* encoding = blocks ? "block" : "samples";
    report::Figure figure{
        .figure = "block_decode_us_per_sample",
        .conditions = {{"language", language}, {"encoding", encoding}, {"batch", batch_size}},
        .unit = "µs",
        .failed = failed};
    if (failed.empty()) figure.value = blocks ? cost.blocks_us : cost.samples_us;
    add(std::string("block_decode_us_per_sample, ") + language + ", " + encoding + ", " + size, figure);
  }
  report::Figure ratio{.figure = "block_decode_gain",
                       .conditions = {{"language", language}, {"batch", batch_size}},
                       .goal = python ? std::optional(100.0) : std::nullopt,
                       .source = "fields over blocks",
                       .failed = failed};
  if (failed.empty()) ratio.value = cost.samples_us / cost.blocks_us;
  add(std::string("block_decode_gain, ") + language + ", " + size, ratio);
}

}  // namespace

int run_decode(const DecodeOptions& options) {
  report::Report report(options.folder);
  report::MarkdownTable table{{"figure", "value", "unit", "goal", "failed"}};
  const AddFigure add = [&](const std::string& name, const report::Figure& figure) {
    report.add(figure);
    table.add_row({name, figure.value ? report::fixed(*figure.value, 3) : report::kNoNumber, figure.unit,
                   figure.goal ? report::fixed(*figure.goal, 1) : "", figure.failed});
  };
  for (const bool python : {false, true}) {
    for (const unsigned batch_size : {kLiveBatch, kBulkBatch})
      add_decode_cost(report.folder() / "batches", options.quick ? 2.0 : 5.0, python, batch_size, add);
  }
  report.add_table("decode", "Decoding telemetry, a sample at a time and a block at a time", table);
  return 0;
}

}  // namespace hapticd::bench
