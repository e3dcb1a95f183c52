
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli/commands/commands.h"
#include "client/cli/plot/recording_figure.h"
#include "client/cli/plot/recording_table.h"
#include "client/cli/plot/svg_file.h"
#include "client/cli/session/print.h"

namespace hapticd::cli {
namespace {

struct PlotOptions {
  std::string recording;
  std::string svg;
};

}  // namespace

void add_plot_command(CLI::App& app, Session& session) {
  const auto options = std::make_shared<PlotOptions>();
  CLI::App* command =
      app.add_subcommand("plot", "Draws a recording: force over displacement, and the time courses");
  command->footer(
      "Needs gnuplot (Debian: gnuplot-nox), but no daemon. Estimates are drawn over the estimated "
      "displacement,\n"
      "the truth of a simulated rig over the true one: an object that has not yet recovered from the press "
      "before\n"
      "begins deeper, and its true curve is shifted; the plot says by how much.\n\n"
      "Examples:\n  hapticctl plot press.csv --out press.svg\n  hapticctl plot press.mcap --out press.svg");
  command
      ->add_option("RECORDING", options->recording,
                   "CSV of hapticctl telemetry record; MCAP, HDF5 or CSV of hapticctl record")
      ->required();
  command->add_option("-o,--out", options->svg, "Where to write the plot (SVG)")->required();
  command->callback([&session, options] {
    require_svg_path("--out", options->svg);
    const CsvTable table = read_recording(options->recording);
    write_svg(recording_figure(table), options->svg);
    if (session.json) return print_json({{"plot", options->svg}, {"samples", table.rows()}});
    print_line("{}: {} samples drawn", options->svg, table.rows());
  });
}

}  // namespace hapticd::cli
