#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <vector>

#include "client/cpp/client.h"
#include "hal/recording/recording_file.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/bench/recording/parts.h"
#include "tests/measure/report/child_process.h"

namespace hapticd::bench {
namespace {

namespace fs = std::filesystem;
using client::Client;

constexpr std::chrono::seconds kKillTimeout{60};
constexpr double kTicksPerS = 1000.0;
constexpr double kMinRunS = 0.6;
constexpr double kMaxRunS = 2.6;

struct FileTicks {
  std::int64_t last = -1;
  std::int64_t missing = 0;
  std::int64_t count = 0;
};

FileTicks ticks_in(const fs::path& path) {
  const auto file = recording::RecordingFile::open(path.string());
  if (!file) throw std::runtime_error(file.error().text());
  FileTicks ticks;
  recording::RecordingVisitor visitor;
  visitor.row = [&](const recording::Row& row) {
    const std::int64_t tick = row.integer(recording::kTickColumn);
    if (ticks.count > 0) ticks.missing += tick - ticks.last - 1;
    ticks.last = tick;
    ++ticks.count;
    return true;
  };
  const auto end = file->read(visitor);
  if (!end) throw std::runtime_error(end.error().text());
  return ticks;
}

std::vector<fs::path> recordings_in(const fs::path& state) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(state / "recordings")) found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

std::string recording_configuration(const fs::path& state) {
  return "[recording]\nfolder = \"" + state.string() + "\"\nkeep_free_mb = 0.0\nincident_quota_mb = 200.0\n";
}

/// The last ticks that were surely rendered before each kill, in the order of the files.
std::vector<std::int64_t> kill_while_recording(const fs::path& logs, const fs::path& state, int signal,
                                               int kills) {
  std::mt19937 random(static_cast<unsigned>(20261124 + signal));
  std::uniform_real_distribution<double> run_s(kMinRunS, kMaxRunS);
  std::vector<std::int64_t> last;
  for (int kill = 0; kill < kills; ++kill) {
    if (kill % 20 == 0)
      report::Report::note(std::to_string(kill) + " of " + std::to_string(kills) + " kills");
    DaemonProcess daemon(logs / "hapticd_killed.log", {.more_configuration = recording_configuration(state)});
    Client client({.address = daemon.address(), .timeout = kKillTimeout});
    v1::StartRecordingRequest start;
    start.set_name("kill_" + std::to_string(1000 + kill));
    client.start_recording(start);
    std::this_thread::sleep_for(std::chrono::duration<double>(run_s(random)));
    last.push_back(static_cast<std::int64_t>(client.rig_state(client::Histograms::kWithout).tick()));
    ::kill(daemon.pid(), signal);
    daemon.stop();
  }
  // The last one is finished at the next start, too.
  DaemonProcess daemon(logs / "hapticd_last.log", {.more_configuration = recording_configuration(state)});
  daemon.stop();
  return last;
}

/// Counts files that the official reader refuses; nothing if it is not to be had.
std::optional<double> refused_by_official_reader(const fs::path& logs, const std::vector<fs::path>& files) {
  const fs::path packages = program_folder().parent_path() / "official_reader";
  if (!fs::exists(packages / "node_modules/@mcap/core")) return std::nullopt;
  double refused = 0.0;
  constexpr std::size_t kAtOnce = 50;
  for (std::size_t first = 0; first < files.size(); first += kAtOnce) {
    std::vector<std::string> command{"node", SOURCE_FOLDER "/tests/integration/recording/official_reader.mjs",
                                     packages.string()};
    for (std::size_t i = first; i < std::min(first + kAtOnce, files.size()); ++i)
      command.push_back(files[i].string());
    const auto ran = report::run_program({.command = command}, std::chrono::seconds(300));
    if (!ran.installed) return std::nullopt;
    std::istringstream lines(ran.output);
    std::size_t answers = 0;
    for (std::string line; std::getline(lines, line);) {
      const auto json = nlohmann::json::parse(line, nullptr, false);
      if (!json.is_object()) continue;
      ++answers;
      if (json.contains("failed")) ++refused;
    }
    if (answers != command.size() - 3) throw std::runtime_error("the official reader failed: " + ran.output);
  }
  std::ofstream(logs / "official_reader.txt") << files.size() << " files, " << refused << " refused\n";
  return refused;
}

void add_signal_figures(const fs::path& folder, int signal, const std::string& name, int kills,
                        const AddFigure& add) {
  const fs::path state = folder / name;
  report::Figure lost{.figure = "recording_lost_s", .conditions = {{"kill", name}}, .unit = "s", .goal = 1.0};
  report::Figure own{
      .figure = "recording_unreadable", .conditions = {{"kill", name}, {"reader", "own"}}, .goal = 0.0};
  report::Figure official{
      .figure = "recording_unreadable", .conditions = {{"kill", name}, {"reader", "official"}}, .goal = 0.0};
  try {
    const std::vector<std::int64_t> last = kill_while_recording(folder, state, signal, kills);
    const std::vector<fs::path> files = recordings_in(state);
    if (files.size() != last.size()) throw std::runtime_error("recordings are missing");
    double unreadable = 0.0;
    double longest_s = 0.0;
    for (std::size_t i = 0; i < files.size(); ++i) {
      try {
        const FileTicks ticks = ticks_in(files[i]);
        const auto lost_ticks =
            static_cast<double>(std::max<std::int64_t>(0, last[i] - ticks.last) + ticks.missing);
        longest_s = std::max(longest_s, lost_ticks / kTicksPerS);
      } catch (const std::exception&) {
        ++unreadable;
      }
    }
    lost.value = longest_s;
    own.value = unreadable;
    official.value = refused_by_official_reader(folder, files);
    if (!official.value)
      official.failed = "node or its packages are not there; the test Recording fetches them";
  } catch (const std::exception& error) {
    for (report::Figure* figure : {&lost, &own, &official}) figure->failed = error.what();
  }
  const std::string count = ", " + std::to_string(kills) + " times";
  add("recording_lost_s, " + name + count, lost);
  add("recording_unreadable, " + name + ", own reader", own);
  add("recording_unreadable, " + name + ", official reader", official);
}

/// A recording cut at random bytes, as a loss of power may leave it.
void add_cut_figures(const fs::path& folder, int cuts, const AddFigure& add) {
  report::Figure unreadable{.figure = "recording_unreadable",
                            .conditions = {{"kill", "cut_anywhere"}, {"reader", "own"}},
                            .goal = 0.0};
  report::Figure lost{
      .figure = "recording_lost_s", .conditions = {{"kill", "cut_anywhere"}}, .unit = "s", .goal = 1.0};
  try {
    const std::vector<fs::path> files = recordings_in(folder / "sigkill");
    const fs::path whole = files.at(files.size() / 2);
    std::ifstream stream(whole, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    // Ends of chunks and the ticks up to there: what a cut behind them must leave.
    const auto reader = recording::McapReader::open(whole.string());
    if (!reader) throw std::runtime_error(reader.error().text());
    const auto summary = reader->summary();
    if (!summary || summary->chunks.empty()) throw std::runtime_error("the recording has no summary");
    const std::uint64_t first_chunk_end = summary->chunks[0].offset + summary->chunks[0].length;
    std::mt19937_64 random(20261124);
    std::uniform_int_distribution<std::uint64_t> at(first_chunk_end, bytes.size() - 1);
    const fs::path cut = folder / "cut.mcap";
    double failed = 0.0;
    double longest_s = 0.0;
    for (int i = 0; i < cuts; ++i) {
      const std::uint64_t size = at(random);
      std::ofstream(cut, std::ios::binary | std::ios::trunc)
          .write(bytes.data(), static_cast<std::streamsize>(size));
      try {
        const auto repaired = recording::repair(cut.string());
        if (!repaired) throw std::runtime_error(repaired.error().text());
        const FileTicks left = ticks_in(cut);
        // Kept of what was in the bytes: what is behind the last whole chunk.
        std::size_t whole_chunks = 0;
        for (const auto& chunk : summary->chunks) whole_chunks += chunk.offset + chunk.length <= size ? 1 : 0;
        const double chunk_s = whole_chunks < summary->chunks.size()
                                   ? 1e-9 * static_cast<double>(summary->chunks[whole_chunks].end_time_ns -
                                                                summary->chunks[whole_chunks].start_time_ns)
                                   : 0.0;
        if (left.missing > 0) ++failed;
        longest_s = std::max(longest_s, chunk_s);
      } catch (const std::exception&) {
        ++failed;
      }
    }
    unreadable.value = failed;
    lost.value = longest_s;
  } catch (const std::exception& error) {
    unreadable.failed = lost.failed = error.what();
  }
  add("recording_unreadable, cut at " + std::to_string(cuts) + " random bytes", unreadable);
  add("recording_lost_s, cut at random bytes", lost);
}

}  // namespace

void add_kill_figures(const fs::path& folder, bool quick, const AddFigure& add) {
  add_signal_figures(folder, SIGKILL, "sigkill", quick ? 10 : 200, add);
  add_signal_figures(folder, SIGSEGV, "sigsegv", quick ? 3 : 20, add);
  add_cut_figures(folder, quick ? 50 : 1000, add);
}

}  // namespace hapticd::bench
