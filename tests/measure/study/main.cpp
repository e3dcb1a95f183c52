// hapticd_study: everything measured in virtual time, seeded and bit-repeatable, as figures, tables and
// plots; and, live, what cannot be had without the real transports.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "tests/measure/study/common/page.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/study.h"
#include "tests/measure/report/provenance.h"

namespace {

using hapticd::study::Study;
using hapticd::study::StudyPart;

struct Options {
  std::string folder;
  std::vector<std::string> only;
  std::string transport = "direct";
  std::string plant = "both";
  bool quick = false;
  std::string shard = "1/1";
  std::vector<std::string> merge;
};

bool is_wanted(const StudyPart& part, const std::vector<std::string>& only) {
  return only.empty() || std::find(only.begin(), only.end(), part.name) != only.end();
}

/// Shards of different programs or lengths do not mix.
hapticd::report::Cells cells_of(const Options& options) {
  using hapticd::report::Cells;
  const std::string revision = hapticd::report::commit() + (options.quick ? ", quick" : "");
  if (options.merge.empty()) {
    return Cells(options.folder, revision, hapticd::report::Shard::from(options.shard));
  }
  return Cells(options.folder, revision,
               std::vector<std::filesystem::path>(options.merge.begin(), options.merge.end()));
}

/// A part on one family of objects; none if they have nothing to do with it.
struct Turn {
  const StudyPart* part;
  std::optional<hapticd::sim::Plant> plant;
};

std::vector<Turn> turns_of(const std::vector<StudyPart>& parts, const Options& options) {
  using hapticd::study::PlantUse;
  std::vector<Turn> turns;
  for (const StudyPart& part : parts) {
    if (!is_wanted(part, options.only)) continue;
    if (part.plants == PlantUse::kNone) {
      turns.push_back({&part, std::nullopt});
      continue;
    }
    for (const std::string& name : hapticd::sim::plant_names()) {
      const auto plant = hapticd::sim::plant_named(name);
      const bool has_it = part.plants == PlantUse::kBoth || plant == hapticd::sim::Plant::kSeparable;
      if (has_it && (options.plant == "both" || options.plant == name)) turns.push_back({&part, plant});
    }
  }
  return turns;
}

/// The number of parts that ended with an error.
int run(const Study& study, const Options& options) {
  using Clock = std::chrono::steady_clock;
  hapticd::report::Report report(options.folder);
  hapticd::report::Cells cells = cells_of(options);
  const bool shared = cells.merges() || !cells.shard().is_whole();
  hapticd::study::StudyContext context{report, options.quick, cells};
  std::vector<Turn> turns = turns_of(options.transport == "emulated" ? study.emulated : study.parts, options);
  if (shared) std::erase_if(turns, [](const Turn& turn) { return !turn.part->in_cells; });
  int failures = 0;
  for (const Turn& turn : turns) {
    const StudyPart& part = *turn.part;
    const auto plant = turn.plant.value_or(hapticd::sim::Plant::kSeparable);
    const std::string suffix = hapticd::study::plant_suffix(plant);
    const std::string plant_name = turn.plant ? hapticd::sim::name_of(plant) : "";
    hapticd::study::set_current_plant(plant);
    cells.set_suffix(suffix);
    report.set_condition(turn.plant ? "plant" : "", plant_name, suffix);
    std::cout << "\n--- " << study.name << ", " << part.name << (turn.plant ? ", plant " : "") << plant_name
              << " (" << &turn - turns.data() + 1 << " of " << turns.size() << "): " << part.shows
              << std::endl;
    report.begin_section(std::string(study.name) + "_" + part.name, part.shows);
    const auto start = Clock::now();
    try {
      part.run(context);
    } catch (const std::exception& error) {
      ++failures;
      std::cerr << "error: " << study.name << ", " << part.name << ": " << error.what() << std::endl;
    }
    const std::chrono::duration<double> took = Clock::now() - start;
    std::cout << "(" << hapticd::report::fixed(took.count(), 1) << " s)" << std::endl;
  }
  report.set_condition("", "", "");
  if (cells.shard().is_whole()) {
    if (study.summarize != nullptr) study.summarize(context);
    hapticd::study::write_page(study, context);
  }
  std::cout << "\nfigures: " << (report.folder() / "figures.jsonl").string() << std::endl;
  return failures;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Measures hapticd, in virtual time where that suffices: the same figures on every machine."};
  app.require_subcommand(1);
  app.footer(
      "Example: hapticd_study rig --out /tmp/rig --quick\nRecordings are looked for in $HAPTICD_RECORDINGS.");

  Options options;
  int failures = 0;
  CLI::App* all = app.add_subcommand("all", "every study, each in a folder of its own");
  all->add_option("--out", options.folder, "folder for the studies' folders; made if need be")->required();
  all->add_flag("--quick", options.quick, "fewer cases, the same figures");
  all->callback([&options, &failures] {
    const std::filesystem::path folder = options.folder;
    for (const Study& study : hapticd::study::studies()) {
      options.folder = (folder / study.name).string();
      failures += run(study, options);
    }
  });
  for (const Study& study : hapticd::study::studies()) {
    CLI::App* command = app.add_subcommand(study.name, study.shows);
    command
        ->add_option("--out", options.folder, "folder for figures.jsonl, tables and plots; made if need be")
        ->required();
    command->add_flag("--quick", options.quick, "fewer cases, the same figures");
    std::vector<std::string> parts;
    for (const StudyPart& part : study.parts) parts.emplace_back(part.name);
    command->add_option("--only", options.only, "only these parts")->check(CLI::IsMember(parts));
    command
        ->add_option("--plant", options.plant,
                     "the laws the simulated objects follow: separable relaxation (the inverse of the creep "
                     "law), general (no one's inverse), or both, one after the other, where a part has to do "
                     "with objects")
        ->check(CLI::IsMember({"both", "separable", "general"}))
        ->capture_default_str();
    if (!study.emulated.empty()) {
      command
          ->add_option("--transport", options.transport,
                       "direct: the simulated rig in virtual time; emulated: live, by the drivers of real "
                       "hardware from peers that speak its protocols")
          ->check(CLI::IsMember({"direct", "emulated"}));
    }
    if (std::any_of(study.parts.begin(), study.parts.end(), [](const StudyPart& p) { return p.in_cells; })) {
      auto* shard = command->add_option("--shard", options.shard,
                                        "i/n: only the i-th of n shares of the sweeps, to be merged later");
      command
          ->add_option("--merge", options.merge,
                       "folders of all shards: draw what they computed, as one run would have")
          ->excludes(shard);
    }
    command->callback([&study, &options, &failures] { failures = run(study, options); });
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << std::endl;
    return 1;
  }
  return failures == 0 ? 0 : 1;
}
