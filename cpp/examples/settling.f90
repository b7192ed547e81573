! Drag on eight spheres that settle in a periodic box: nearest neighbours, then the model.
!
! gfortran -c settling.f90 && g++ -c ../dustfall.cpp -I.. &&
! gfortran settling.o dustfall.o -lstdc++ -o settling && ./settling model.json

module dustfall
  use, intrinsic :: iso_c_binding
  implicit none

  interface
    function dustfall_load(path) result(model) bind(c)
      import
      character(kind=c_char), intent(in) :: path(*)
      type(c_ptr) :: model
    end function

    subroutine dustfall_free(model) bind(c)
      import
      type(c_ptr), value :: model
    end subroutine

    function dustfall_neighbours(model) result(number) bind(c)
      import
      type(c_ptr), value :: model
      integer(c_int) :: number
    end function

    function dustfall_drag(model, count, flow, neighbours, at_rest, beta, side) &
        result(status) bind(c)
      import
      type(c_ptr), value :: model
      integer(c_int64_t), value :: count
      real(c_double), intent(in) :: flow(3, *), neighbours(3, *), at_rest(3)
      real(c_double), intent(out) :: beta(*), side(3, *)
      integer(c_int) :: status
    end function

    function dustfall_nearest(count, positions, period, number, vectors, rows) &
        result(status) bind(c)
      import
      integer(c_int64_t), value :: count
      real(c_double), intent(in) :: positions(3, *), period(3)
      integer(c_int), value :: number
      real(c_double), intent(out) :: vectors(3, number, *)
      integer(c_int64_t), intent(out) :: rows(number, *)
      integer(c_int) :: status
    end function
  end interface
end module

program settling
  use dustfall
  implicit none

  integer(c_int64_t), parameter :: spheres = 8
  real(c_double), parameter :: period(3) = 9, up(3) = [0, 0, 1]
  real(c_double) :: position(3, spheres), flow(3, spheres), beta(spheres), side(3, spheres)
  real(c_double), allocatable :: vectors(:, :, :)
  integer(c_int64_t), allocatable :: rows(:, :)
  integer(c_int) :: number
  character(len=1024) :: path
  type(c_ptr) :: model
  integer :: i

  call get_command_argument(1, path)
  model = dustfall_load(trim(path)//c_null_char)
  if (.not. c_associated(model)) error stop 'the model was refused'
  ! All settle at one velocity: the fluid runs upwards past them.
  do i = 1, int(spheres)
    position(:, i) = [mod(i - 1, 3) * 3.0_c_double, (i - 1) / 3 * 2.5_c_double, i - 1.0_c_double]
    flow(:, i) = up
  end do
  number = dustfall_neighbours(model)
  allocate (vectors(3, number, spheres), rows(number, spheres))
  if (dustfall_nearest(spheres, position, period, number, vectors, rows) /= 0) &
    error stop 'no neighbours were found'
  if (dustfall_drag(model, spheres, flow, vectors, up, beta, side) /= 0) &
    error stop 'the model failed'
  do i = 1, int(spheres)
    print '(4f20.12)', beta(i), side(:, i)
  end do
  call dustfall_free(model)
end program
