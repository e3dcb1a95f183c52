#pragma once

#include <string>

#include "rt/model/identified_model.h"
#include "rt/model/models.h"

namespace hapticd::study {

/// A model that ships in server/model/shipped, made as the service makes one: what its identifications
/// request for is done on the simulated rig, and what they find is put together. Minutes of virtual time,
/// seconds of real.
struct ShippedModel {
  rt::ObjectModel model;
  rt::IdentifiedModel contact, friction;
};
ShippedModel identify_to_ship(const std::string& object);

}  // namespace hapticd::study
