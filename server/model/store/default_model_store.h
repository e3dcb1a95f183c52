#pragma once

#include <string>

namespace hapticd::server {

/// Path of the models if none is given: models.sqlite in $STATE_DIRECTORY (systemd), else in
/// $XDG_STATE_HOME/hapticd, else in $HOME/.local/state/hapticd. Empty if none of them is set.
std::string default_model_store();

}  // namespace hapticd::server
