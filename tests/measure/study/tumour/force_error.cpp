#include <string>
#include <vector>

#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/tumour/tumour_trial.h"

namespace hapticd::study {

namespace {

struct Tumour {
  const char* name;
  const char* phantom;
  double depth_mm;  ///< of the presses: up to about 8 N over the tumour
};

}  // namespace

void run_tumour_force(StudyContext& context) {
  using report::fixed;
  report::MarkdownTable table(
      {"tumour", "place mm", "variant", "error % at 20 mm/s", "60 mm/s", "100 mm/s", "largest real force N"});
  for (const Tumour& tumour : {Tumour{"hard", "phantom_hard", 11.5}, Tumour{"soft", "phantom_soft", 14.0}}) {
    const rt::InclusionParameters energy = identified_tumour(tumour.phantom).by_scan.inclusion;
    const rt::InclusionParameters published = identified_tumour(tumour.phantom).by_pair.inclusion;
    for (const double place_mm : {0.0, 10.0, 20.0}) {
      report::Plot plot;
      plot.title = "Press " + fixed(place_mm, 0) + " mm from the " + tumour.name +
                   " tumour, 60 mm/s: at the hand (D Fig. 5.4)";
      plot.x = {"depth of the tip", "mm"};
      plot.y = {"force", "N"};
      std::vector<std::vector<std::string>> rows{{tumour.name, fixed(place_mm, 0), "energy"},
                                                 {tumour.name, fixed(place_mm, 0), "published"}};
      double largest_n = 0.0;
      for (const double speed : {20.0, 60.0, 100.0}) {
        if (context.quick && speed != 60.0) continue;
        const PhantomPress press{place_mm, 0.0, tumour.depth_mm, speed};
        const PressCurve real = press_real(tumour.phantom, press);
        for (const double f : real.force_n) largest_n = std::max(largest_n, f);
        for (std::size_t variant = 0; variant < 2; ++variant) {
          const PressCurve rendered = press_rendered({variant == 0 ? energy : published}, press);
          const double error = curve_error(rendered, real);
          rows[variant].push_back(fixed(100.0 * error, 1));
          report::Figure figure{"tumour_force_error",
                                {{"place_mm", fixed(place_mm, 0)},
                                 {"tumour", tumour.name},
                                 {"variant", variant == 0 ? "energy" : "published"},
                                 {"speed_mm_per_s", fixed(speed, 0)}}};
          figure.value = error;
          figure.source = "rms over rms, while loading from 1 mm on";
          context.report.add(figure);
          if (speed != 60.0) continue;
          plot.series.push_back({.name = variant == 0 ? "energy" : "published",
                                 .points = cli::points_of(rendered.depth_mm, rendered.force_n)});
        }
        if (speed == 60.0)
          plot.series.push_back(
              {.name = "real tumour", .points = cli::points_of(real.depth_mm, real.force_n)});
      }
      for (auto& row : rows) {
        while (row.size() < 6) row.emplace_back("");
        row.push_back(fixed(largest_n, 1));
        table.add_row(row);
      }
      context.report.add_plot(std::string("tumour_") + tumour.name + "_" + fixed(place_mm, 0) + "mm", plot);
    }
  }
  context.report.add_table("tumour_force", "A virtual tumour against a real one", table,
                           "Vertical presses of a phantom, guided as in D§5.4; force: sensor and device.");
}

}  // namespace hapticd::study
