/* The consecutive value references of the C interface, shared by the hand-written models. */
#define VR_TIME 0
#define VR_X 1
#define VR_DX (VR_X + N_X)
#define VR_U (VR_DX + N_X)
#define VR_P (VR_U + N_U)
#define VR_D (VR_P + N_P)
#define VR_W (VR_D + N_D)
#define VR_G (VR_W + N_W)
#define VR_END (VR_G + N_G)
