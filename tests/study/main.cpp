// hapticd_study: everything measured in virtual time, seeded and bit-repeatable, as figures, tables and
// plots; and, live, what cannot be had without the real transports.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "tests/study/study.h"

namespace {

using hapticd::study::Study;
using hapticd::study::StudyPart;

struct Options {
  std::string folder;
  std::vector<std::string> only;
  std::string transport = "direct";
  bool quick = false;
};

bool is_wanted(const StudyPart& part, const std::vector<std::string>& only) {
  return only.empty() || std::find(only.begin(), only.end(), part.name) != only.end();
}

/// The number of parts that ended with an error.
int run(const Study& study, const Options& options) {
  using Clock = std::chrono::steady_clock;
  hapticd::report::Report report(options.folder);
  hapticd::study::StudyContext context{report, options.quick};
  int failures = 0;
  for (const StudyPart& part : options.transport == "emulated" ? study.emulated : study.parts) {
    if (!is_wanted(part, options.only)) continue;
    std::cout << "\n--- " << study.name << ", " << part.name << ": " << part.shows << std::endl;
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
  for (const Study& study : hapticd::study::studies()) {
    CLI::App* command = app.add_subcommand(study.name, study.shows);
    command
        ->add_option("--out", options.folder, "folder for figures.jsonl, tables and plots; made if need be")
        ->required();
    command->add_flag("--quick", options.quick, "fewer cases, the same figures");
    std::vector<std::string> parts;
    for (const StudyPart& part : study.parts) parts.emplace_back(part.name);
    command->add_option("--only", options.only, "only these parts")->check(CLI::IsMember(parts));
    if (!study.emulated.empty()) {
      command
          ->add_option("--transport", options.transport,
                       "direct: the simulated rig in virtual time; emulated: live, by the drivers of real "
                       "hardware from peers that speak its protocols")
          ->check(CLI::IsMember({"direct", "emulated"}));
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
