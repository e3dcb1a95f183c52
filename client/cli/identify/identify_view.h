#pragma once

#include <string>
#include <vector>

#include "client/cli/terminal/terminal.h"
#include "hapticd/v1/identification.pb.h"

namespace hapticd::cli {

/// Frame for the person at the rig while an identification runs: what to do next in a box, how far it is, the
/// parameters with their standard errors, what is missing, the coverage and the fit. As much as the terminal
/// has room for, the most important first. `notice` is about the connection; empty while all is well.
std::vector<std::string> identify_frame(const v1::IdentificationProgress& progress, const std::string& notice,
                                        const Terminal& terminal);

/// Progress as one plain line.
std::string identify_line(const v1::IdentificationProgress& progress, const Terminal& terminal);

/// Report of the outcome: result, parameters, what is missing, why it failed, and how to go on with the
/// model. `adopted`: the user asked to adopt it if it converges.
std::vector<std::string> identify_report(const v1::IdentificationProgress& progress, bool adopted,
                                         const Terminal& terminal);

/// Draws the fit, measured and modelled, as `height` lines; empty if there is no fit.
std::vector<std::string> draw_fit(const v1::IdentificationProgress& progress, int width, int height,
                                  const Terminal& terminal);

/// Label as the plots have it: "displacement / mm" for "displacement [mm]".
std::string plot_label(const std::string& text);

/// "contact of sponge", "friction of sponge, from the recording recording-3", "tool".
std::string identify_subject(const v1::IdentificationProgress& progress);

/// True if it is over, however it ended.
bool is_over(const v1::IdentificationProgress& progress);

/// True if it ended in an earlier run of the daemon, which keeps its result and not how long it took.
bool is_of_earlier_run(const v1::IdentificationProgress& progress);

}  // namespace hapticd::cli
