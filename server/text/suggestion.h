#pragma once

#include "proto/text/suggestion.h"

namespace hapticd::server {

using text::comma_separated;
using text::did_you_mean;
using text::nearest;

}  // namespace hapticd::server
