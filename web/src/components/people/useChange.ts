/** A change to people: afterwards everything is asked for anew, and a refusal is said. */
import { notifications } from '@mantine/notifications'
import { useQueryClient } from '@tanstack/react-query'
import { refusalOf } from '../../api/errors'

export function useChange() {
  const client = useQueryClient()
  return (what: string) => ({
    onError: (error: unknown) =>
      notifications.show({ color: 'red', title: `Could not ${what}`, message: refusalOf(error) }),
    onSettled: () => void client.invalidateQueries(),
  })
}
