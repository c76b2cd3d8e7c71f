/* guid.c - of a model written by hand, whose start values stand in its model.c. */
#include "model.h"

const char model_guid[] = MODEL_GUID;
