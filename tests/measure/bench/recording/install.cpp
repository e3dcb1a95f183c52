#include <stdexcept>

#include "tests/measure/bench/recording/parts.h"
#include "tests/measure/report/child_process.h"

namespace hapticd::bench {

void add_install_figure(const std::filesystem::path& folder, const std::string& packages,
                        const AddFigure& add) {
  constexpr std::string_view kSays = "install_to_status_s ";
  report::Figure figure{.figure = "install_to_status_s", .unit = "s", .goal = 30.0};
  try {
    if (packages.empty()) throw std::runtime_error("no packages: give --packages DIR of deploy/package.sh");
    const auto ran = report::run_program({.command = {"bash", SOURCE_FOLDER "/deploy/try_packages.sh",
                                                      packages, "--log", (folder / "install.log").string()}},
                                         std::chrono::minutes(20));
    const std::size_t at = ran.output.find(kSays);
    if (ran.status != 0 || at == std::string::npos) throw std::runtime_error(ran.output);
    figure.value = std::stod(ran.output.substr(at + kSays.size()));
  } catch (const std::exception& error) {
    figure.failed = error.what();
  }
  add("install_to_status_s", figure);
}

}  // namespace hapticd::bench
