#define MODEL_IDENTIFIER kink
#define MODEL_GUID "{kink}"
#define N_X 1
#define N_U 0
#define N_P 3
#define N_D 0
#define N_W 1
#define N_Y 1
#define N_G 1
#define DEFAULT_TOLERANCE 1e-6
#include "value_references.h"
