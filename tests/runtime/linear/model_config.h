#define MODEL_IDENTIFIER linear
#define MODEL_GUID "{linear}"
#define N_X 3
#define N_U 2
#define N_P 4
#define N_D 1
#define N_W 4
#define N_Y 3
#define N_G 0
#define DEFAULT_TOLERANCE 1e-6
#include "value_references.h"
