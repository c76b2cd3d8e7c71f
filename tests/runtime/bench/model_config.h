#define MODEL_IDENTIFIER bench
#define MODEL_GUID "{bench}"
#define N_X 0
#define N_U 1
#define N_P 3
#define N_D 0
#define N_W 2
#define N_Y 1
#define N_G 2
#define DEFAULT_TOLERANCE 1e-6
#include "value_references.h"
