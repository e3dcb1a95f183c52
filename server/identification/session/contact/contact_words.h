#pragma once

#include <string>

#include "server/identification/estimate/contact/contact_creep_fit.h"
#include "server/identification/estimate/contact/contact_law_choice.h"
#include "server/identification/session/tasks.h"

namespace hapticd::identification {

const char* words_of(ContactFitMethod method);
/// Words on what each law leaves of the displacement held out, and which was chosen.
std::string words_of(const ContactLawChoice& choice);
/// Words on what creeps more slowly than any contact lasted; empty if all was seen.
std::string words_of_unseen(const CreepEstimate& creep);

}  // namespace hapticd::identification
