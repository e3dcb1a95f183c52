#pragma once

#include <string>
#include <vector>

#include "client/cli/session/terminal.h"
#include "hapticd/v1/identification.pb.h"

namespace hapticd::cli {

/// What a person at the rig sees while an identification runs: what to do next in a box, how far it is, the
/// parameters with their standard errors, what is missing, the coverage and the fit. As much as the terminal
/// has room for, the most important first. `notice` is about the connection; empty while all is well.
std::vector<std::string> identify_frame(const v1::IdentificationProgress& progress, const std::string& notice,
                                        const Terminal& terminal);

/// The same as one plain line.
std::string identify_line(const v1::IdentificationProgress& progress, const Terminal& terminal);

/// The outcome: result, parameters, what is missing, why it failed, and how to go on
/// with the model. `adopted`: the user asked to adopt it if it converges.
std::vector<std::string> identify_report(const v1::IdentificationProgress& progress, bool adopted,
                                         const Terminal& terminal);

/// The fit, measured and modelled, as `height` lines; empty where there is no fit.
std::vector<std::string> draw_fit(const v1::IdentificationProgress& progress, int width, int height,
                                  const Terminal& terminal);

/// A label as the plots have it: "displacement / mm" for "displacement [mm]".
std::string plot_label(const std::string& text);

/// "contact of sponge", "friction of sponge, from the recording recording-3", "tool".
std::string identify_subject(const v1::IdentificationProgress& progress);

/// Over, however it ended.
bool is_over(const v1::IdentificationProgress& progress);

}  // namespace hapticd::cli
