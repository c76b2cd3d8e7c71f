#define MODEL_IDENTIFIER dahlquist
#define MODEL_GUID "{dahlquist}"
#define N_X 1
#define N_U 0
#define N_P 1
#define N_D 1
#define N_W 2
#define N_Y 1
#define N_G 0
#define DEFAULT_TOLERANCE 1e-6
#include "value_references.h"
