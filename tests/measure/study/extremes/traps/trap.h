#pragma once

#include <string>
#include <vector>

#include "tests/measure/study/common/study.h"

namespace hapticd::study::extremes {

/// Form of doing a thing, and the quantity that decides between them.
struct TrapForm {
  std::string form;  ///< "published", "here"
  double value = 0.0;
};

/// An equation or number that fails as published, next to what is done here.
struct Trap {
  std::string name;      ///< "unit of K_d (3.6)"
  std::string fails;     ///< what fails, from which value on
  std::string predicts;  ///< the closed form that says so
  std::string quantity;  ///< what is measured
  std::string unit;
  double limit = 0.0;  ///< of stability, or of what would be right
  std::vector<TrapForm> forms;
  std::string plot_name{};  ///< empty = nothing to plot
  report::Plot plot{};
};

Trap derivative_gain_trap();      // 1
Trap integrating_loop_trap();     // 2
Trap stability_bound_trap();      // 3
Trap deflection_loop_trap();      // 4
Trap deflection_sign_trap();      // 5
Trap dahl_counting_trap();        // 6, (4.14)
Trap dahl_euler_trap();           // 6, light touch
Trap tumour_trap();               // 7
Trap inverse_noise_trap();        // 8
Trap static_sponge_trap();        // 9
Trap staircase_trap(bool quick);  // 10
Trap encoder_trap();              // 11

/// Small, so that a dozen stay readable; published: orange and dashed; ours: blue and solid.
report::Plot small_plot(std::string title, report::PlotAxis x, report::PlotAxis y);
report::PlotSeries published(std::string label);
report::PlotSeries ours(std::string label);

}  // namespace hapticd::study::extremes
